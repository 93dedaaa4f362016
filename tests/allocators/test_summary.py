"""The summary of a result."""

import numpy as np
import pytest

from alloc.allocators import solve
from alloc.allocators.summary import bottleneck_lines, rounded_up, summary
from alloc.problems import Instance
from alloc.problems.generate import paper


@pytest.mark.parametrize(
    ("ability", "whole", "text"),
    [
        (2.0, True, "2"),
        (2.0001, True, "3"),
        (0.96101, False, "0.962"),
        (123.4, False, "124"),
        (999_998.5, True, "999999"),
        (1_234_000.0, True, "1.24e+06"),
        (1.2345e300, True, "1.24e+300"),
    ],
)
def test_abilities_are_rounded_up(ability, whole, text):
    """The stated ability suffices, and long numbers are formatted as elsewhere."""
    assert float(text) >= ability
    assert rounded_up(ability, whole=whole) == text


def test_tied_bottlenecks_gain_nothing():
    """Tied tasks are named, and one more agent on one of them gains nothing."""
    lines = bottleneck_lines(solve(Instance(ability=[2, 2], workload=[2, 2]), "greedy", handle_signals=False))
    assert lines[0].startswith("Bottleneck: 2 of 2 tasks together, at 1: t1, t2")
    assert "gains nothing" in lines[1]
    assert "100 % of the total ability is in use" in lines[2]


def test_single_task_reports_the_gain_of_a_median_agent():
    """Without a next task no ability is enough; the gain of a median agent is reported instead."""
    lines = bottleneck_lines(solve(Instance(ability=[3], workload=[6]), "greedy", handle_signals=False))
    assert "of ability 3, the median, gains 50 %: 1." in lines[1]


def test_finite_speeds_are_mentioned():
    """With travel times the summary says that the additional agent starts at the task."""
    instance = Instance(
        ability=[3, 1], workload=[6, 1], speed=[1, 1], agent_position=[[0, 0], [0, 1]], task_position=[[1, 0], [0, 1]]
    )
    assert "One more agent there that starts at the task" in "\n".join(
        bottleneck_lines(solve(instance, "greedy", handle_signals=False))
    )


def test_singular_forms():
    """One agent and one task are in the singular."""
    result = solve(Instance(name="one", ability=[3], workload=[6]), "greedy", handle_signals=False)
    assert summary(result).startswith("one (1 agent, 1 task), greedy: ")


def test_no_work_is_no_bottleneck():
    """Without any work the summary says so."""
    result = solve(Instance(ability=[3], workload=[0]), "greedy", handle_signals=False)
    assert "There is no work to do." in summary(result)
    assert "optimal" in summary(result)


def test_slack_qualifies_the_bottleneck():
    """With slack the cheapest allocation is proven, but the same agents may well be faster."""
    instance = Instance(
        ability=[1, 1, 1], workload=[3, 1], task_position=[[0, 0], [9, 0]], agent_position=[[0, 0], [9, 0], [9, 0]]
    )
    result = solve(
        instance, "milp", objective="makespan-energy", makespan_slack=9, handle_signals=False, time_limit_s=30
    )
    assert result.energy == 0
    lines = summary(result)
    assert "optimal; no allocation within" in lines
    assert "cannot be faster" not in lines
    assert "reallocating the same agents gains at most" in lines


@pytest.mark.parametrize(
    ("sites", "text"),
    [
        ([1, 50], "1 of 2 tasks cannot be served by any agent"),
        ([1, 2, 3], "1 of 3 tasks cannot be served along with the others"),
        ([1, 2, 3, 50], "2 of 4 tasks cannot be served along with the others, 1 of them by no agent at all"),
    ],
)
def test_headline_distinguishes_kinds_of_unserved_tasks(sites, text):
    """Tasks that compete for two agents are distinguished from tasks that no agent can take."""
    instance = Instance(
        ability=[1, 1],
        workload=[1] * len(sites),
        agent_position=[[0, 0]] * 2,
        task_position=[[x, 0] for x in sites],
        communication_range=[9, 9],
    )
    assert summary(solve(instance, "greedy", handle_signals=False)).splitlines()[0].endswith(f": {text}")


@pytest.mark.parametrize("scenario", [1, 4])
def test_summary_is_short(scenario: int) -> None:
    """A result has fewer than 15 lines, whatever its size and unserved tasks; an instance has one."""
    instance = paper(scenario, seed=1)
    lonely = Instance(ability=np.ones(40), workload=np.ones(60))
    for one in (instance, lonely):
        printed = str(solve(one, "greedy", time_limit_s=1)).splitlines()
        assert len(printed) < 15
        assert max(map(len, printed)) < 250
        assert len(repr(one).splitlines()) == 1


def test_names_cannot_break_lines():
    """Line breaks and control characters in names become spaces in the summary."""
    instance = Instance(agent_ids=["a\n1", "b\x1b[2J"], task_ids=["t\r1", "u\n"], ability=[1, 3], workload=[2, 3])
    text = summary(solve(instance, "greedy", handle_signals=False))
    assert "\x1b" not in text
    assert "\r" not in text
    plain = Instance(agent_ids=["a 1", "b [2J"], task_ids=["t 1", "u"], ability=[1, 3], workload=[2, 3])
    assert len(text.splitlines()) == len(summary(solve(plain, "greedy", handle_signals=False)).splitlines())
