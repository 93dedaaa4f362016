"""The effect of more or fewer agents."""

import re
import threading
from itertools import pairwise

import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, varied_instance

from alloc.allocators import Fleet, InputError, RefusedError, Status, WhatIf, solve, whatif
from alloc.problems import Instance, Units

SEEDS = [seed for seed in range(40) if varied_instance(seed).n <= 4 and all_can_be_served(varied_instance(seed))][:8]


@pytest.mark.parametrize("seed", SEEDS)
def test_every_fleet_matches_brute_force(seed: int) -> None:
    """With copies of an agent, and without another, makespan and energy are optimal and proven."""
    instance = varied_instance(seed)
    gone = [instance.agent_ids[1]] if instance.n > 2 else []
    found = whatif(instance, instance.agent_ids[0], up_to=2, remove=gone, method="milp", objective="makespan-energy")
    assert found.complete
    assert [len(fleet.added) for fleet in found.fleets] == [0] * (1 + len(gone)) + [1, 2]
    assert [list(fleet.removed) for fleet in found.fleets] == [[]] + [gone] * (len(gone) + 2)
    for fleet in found.fleets:
        best, result = brute_force(fleet.result.instance), fleet.result
        assert len(result.evaluation.unserved_tasks) == best.unserved
        if best.unserved == 0:
            assert result.status is Status.OPTIMAL
            assert result.makespan == pytest.approx(best.makespan, rel=1e-6)
            assert result.energy == pytest.approx(best.energy, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_makespans_never_rise_with_more_agents(seed: int) -> None:
    """Even for a random method, more agents never increase the makespan or the bound."""
    instance = varied_instance(seed)
    method = "greedy" if instance.has_travel_time else "ga"
    found = whatif(instance, instance.agent_ids[0], up_to=4, method=method, iterations=1, time_limit_s=None)
    makespans = [fleet.result.makespan for fleet in found.fleets]
    bounds = [fleet.result.lower_bound for fleet in found.fleets]
    for before, after in pairwise(makespans):
        assert after <= before * (1 + 1e-9)
    assert bounds == sorted(bounds, reverse=True)
    for fleet, bound in zip(found.fleets, bounds, strict=True):
        assert bound <= brute_force(fleet.result.instance).makespan * (1 + 1e-9)


def test_copies_differ_only_in_their_ids() -> None:
    """A copy has the place, limits, skills and given distances of its model, and a new id."""
    instance = Instance(
        ability=[1, 2], workload=[3, 1], agent_ids=["d", "d+1"], agent_position=[[0, 0], [1, 1]], battery=[5, 7],
        task_position=[[2, 0], [3, 0]], skills=[["saw"], []], needs=[["saw"], []], distances=[("d", "t1", 4.0)],
    )  # fmt: skip
    found = whatif(instance, "d", up_to=2, method="greedy")
    fleet = found.fleets[-1].result.instance
    assert found.fleets[-1].added == ("d+2", "d+3")
    assert fleet.agent_ids == ("d", "d+1", "d+2", "d+3")
    assert fleet.skills == (("saw",), (), ("saw",), ("saw",))
    assert fleet.battery.tolist() == [5, 7, 5, 5]
    assert fleet.reach.distance[fleet.reach.origin].tolist() == [[4.0, 3.0]] + [[2**0.5, 5**0.5]] + [[4.0, 3.0]] * 2


LINE = Instance(ability=[2, 1], workload=[6], agent_ids=["d1", "d2"], units=Units(time="h"))


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"like": "d2"}, "one more like d2: 1.5 h instead of 2 h (-25 %)"),
        ({"like": "d2", "up_to": 3}, "one more like d2: 1.5 h instead of 2 h (-25 %); 3 more like d2: 1 h (-50 %)"),
        ({"like": ["d1", "d2"]}, "one more like each of d1, d2: 1 h instead of 2 h (-50 %)"),
        ({"remove": ["d2"]}, "without d2: 3 h instead of 2 h (+50 %)"),
        (
            {"remove": ["d1"], "like": "d2", "up_to": 3},
            "without d1: 6 h instead of 2 h (+200 %); one more like d2: 3 h (+50 %); 3 more like d2: 1.5 h (-25 %);"
            " 2 more like d2 make up for it",
        ),
    ],
)
def test_the_answer_is_a_sentence(arguments: dict[str, object], expected: str) -> None:
    """The sentence compares the first and the last step with the current fleet, with units."""
    assert whatif(LINE, method="cpsat", **arguments).answer == expected


def test_small_changes_have_enough_digits() -> None:
    """Two makespans that differ in their fifth digit are not reported as equal."""
    instance = Instance(ability=[1e5, 3.0, 1.0], workload=[1e5])
    assert whatif(instance, "a2", method="cpsat").answer.startswith("one more like a2: 0.99993 instead of 0.99996 (")


def test_answer_with_unserved_tasks_or_no_effect() -> None:
    """Tasks that no agent can serve, and agents without effect, are reported, and whether this is proven."""
    few = Instance(ability=[2, 3], workload=[2, 3, 4])
    assert whatif(few, "a2", up_to=2).answer.startswith("one more like a2: every task is served, in 1.333; 2 more")
    assert whatif(few, remove=["a1"]).answer == "without a1: 2 tasks unserved instead of 1"
    bound = Instance(ability=[1, 1], workload=[4, 1], allowed_tasks=[[0], [1]])
    assert whatif(bound, "a2").answer == "one more like a2: 4 as before (proven)"


@pytest.mark.parametrize("seed", SEEDS)
def test_answer_says_what_is_not_proven(seed: int) -> None:
    """If optimality is not proven, the stated range contains the true change, by brute force."""
    instance = varied_instance(seed)
    found = whatif(instance, instance.agent_ids[0], method="greedy", iterations=1, time_limit_s=None)
    now, more = (fleet.result for fleet in found.fleets)
    best = [brute_force(result.instance).makespan for result in (now, more)]
    ranges = re.findall(r"the optimum: (\S+) to (\S+) %", found.answer)
    is_open = max(now.gap, more.gap) > 1e-6 and "is proven" not in found.answer
    assert len(ranges) == is_open
    for least, most in ranges:
        change = 100 * (best[1] / best[0] - 1)
        assert float(least) - 0.51 <= change <= float(most) + 0.51


def test_stopped_run_keeps_the_fleets_so_far() -> None:
    """After a stop request, the fleets so far are returned and marked as incomplete."""
    stop, seen = threading.Event(), []

    def second(fleet: Fleet) -> None:
        seen.append(fleet)
        if len(seen) == 2:
            stop.set()

    found = whatif(LINE, "d2", up_to=9, method="greedy", stop=stop, on_fleet=second)
    assert isinstance(found, WhatIf)
    assert not found.complete
    assert len(found.fleets) == 2


def test_first_fleet_is_the_instance_itself() -> None:
    """The first fleet has the result of `solve`."""
    assert whatif(LINE, "d2", method="cpsat").fleets[0].result.makespan == solve(LINE, "cpsat").makespan


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "like: needs an agent to add copies of"),
        ({"like": "d3"}, "like: no agent 'd3' in instance 'instance' .known: d1, d2"),
        ({"like": ["d1", 3]}, "like: no agent 3"),
        ({"remove": "d1"}, "remove: must be a list of ids of agents"),
        ({"remove": ["x"]}, "remove: no agent 'x'"),
        ({"like": "d1", "up_to": 0}, "up_to: "),
        ({"like": "d1", "method": "gredy"}, "method: "),
        ({"like": "d1", "time_limit_s": -1}, "time_limit_s: "),
        ({"remove": ["d1", "d2"]}, "remove: leaves no agent"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], message: str) -> None:
    """The error names the parameter."""
    with pytest.raises(InputError, match=message):
        whatif(LINE, **arguments)


def test_refusals_of_the_method_are_raised() -> None:
    """Refusals of the method are raised."""
    with pytest.raises(RefusedError):
        whatif(Instance(ability=[1], workload=[1], speed=[1]), "a1", method="ga")
