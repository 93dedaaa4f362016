"""Findings about possible mistakes in instances, and no false alarms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from alloc.problems import DistanceTable, Family, Instance, paper, random_instance, read_instance
from alloc.problems.diagnosis.plausibility import findings, priority_without_effect

EARTHQUAKES = Path(__file__).parents[3] / "examples" / "earthquakes"


def fleet(**changes: Any) -> Instance:
    """Return three agents and two tasks without findings, except for `changes`."""
    fields: dict[str, Any] = {
        "ability": (2, 3, 4),
        "workload": (6, 7),
        "agent_position": ((0, 0), (1, 2), (3, 1)),
        "task_position": ((1.5, 1), (0, 2)),
    }
    return Instance(**fields | changes)


BERLIN = {
    "agent_position": ((13.4, 52.5), (13.41, 52.52), (13.3, 52.4)),
    "task_position": ((13.5, 52.51), (13.2, 52.6)),
}
NOWHERE = {"agent_position": None, "task_position": None}

DOUBTFUL = [
    (BERLIN, "position", "looks like degrees"),
    ({key: np.flip(places, 1) for key, places in BERLIN.items()}, "position", "looks like degrees"),
    (
        {"agent_position": ((0, 0), (np.nan, np.nan), (3, 1))},
        "position",
        "agent a2 has no place: the distance there counts as 0",
    ),
    ({"task_position": ((0, 0), (np.nan, np.nan))}, "position", "task t2 has no place"),
    ({"battery": (9, 9, 0.5)}, "battery", "a3 reaches no task; to t1, its nearest, energy 1.5 exceeds the battery 0.5"),
    ({"communication_range": (0.1, 0.1, 9)}, "range", "a1 and 1 other reach no task; to t1"),
    (
        {
            "distances": DistanceTable.of(
                [("a1", "t1", 1), ("a2", "t2", 3)], ["a1", "a2", "a3"], ["t1", "t2"], "unreachable"
            )
        },
        "distances",
        "a3 reaches no task; to t1, its nearest, there is no way to it in the table of distances",
    ),
    ({"bases": {"north": (0, 1)}}, "bases", "no agent returns to base north"),
    (
        {"bases": {"north": None}, "return_base": (0, -1, -1)},
        "bases",
        "base north has no place: the distance back counts as 0",
    ),
    (
        {"bases": {"north": (0, 9)}, "return_base": (-1, 0, -1), "battery": (9, 3, 9)},
        "battery",
        "energy 8 exceeds the battery 3 (with the flight back to north)",
    ),
    ({"speed": 3 * [5], **NOWHERE}, "speed", "has no effect"),
    ({"battery": 3 * [5], **NOWHERE}, "battery", "has no effect"),
    ({"ability": (2, 3, 5000)}, "ability", "that of a3 is 2000 times the median of the others, 2.5"),
    ({"ability": (2, 2, 2), "workload": (5, 5), **NOWHERE}, "agents", "all are alike"),
    ({"workload": (1, 2, 3, 4), "task_position": None}, "agents", "3 agents for 4 tasks, and each agent does one task"),
]


@pytest.mark.parametrize(("changes", "field", "words"), DOUBTFUL)
def test_implausible_values_are_found(changes: dict[str, Any], field: str, words: str) -> None:
    """There is one finding, with the name of the field in files and a description."""
    found = findings(fleet(**changes))
    assert [one.field for one in found] == [field]
    assert words in found[0].message
    assert "\n" not in found[0].message


def test_given_distances_need_no_places() -> None:
    """An agent without a place is not a finding if a table gives its distances."""
    table = DistanceTable.of([("a2", "t1", 3.0), ("a2", "t2", 4.0)], ("a1", "a2", "a3"), ("t1", "t2"))
    assert findings(fleet(agent_position=((0, 0), (np.nan, np.nan), (3, 1)), distances=table)) == ()


def test_intended_degrees_are_no_finding() -> None:
    """With the geographic metric, degrees are not a finding."""
    assert findings(fleet(**BERLIN, metric="geographic")) == ()


def test_priorities_without_effect_are_found() -> None:
    """Different priorities are a finding if all tasks can be served; equal ones are not."""
    assert priority_without_effect(fleet()) is None
    found = priority_without_effect(fleet(priority=(1, 2)))
    assert found is not None
    assert "has no effect on plans" in found.message


@pytest.mark.parametrize("scenario", [1, 2, 3, 4])
def test_no_false_alarm_on_the_scenarios_of_the_paper(scenario: int) -> None:
    """Scenarios of the paper have no findings."""
    for seed in range(3):
        assert findings(paper(scenario, seed)) == ()


def test_no_false_alarm_on_random_instances() -> None:
    """Random instances with enough agents and reach have no findings."""
    for seed in range(20):
        assert findings(random_instance(Family(agents=40, tasks=8, speed=(0.5, 2.0)), seed)) == ()


def test_no_false_alarm_on_the_example() -> None:
    """The example of Alaska, with positions in kilometres, has no findings."""
    assert findings(read_instance(EARTHQUAKES / "alaska.json")) == ()
