"""All faults of a mission's document are reported, one error each."""

import copy
import json
import math

import pytest

from alloc.problems import InputError, MissionParameters, random_mission
from alloc.problems.formats import json_text
from alloc.problems.missions.files.document import mission_from_document, mission_to_document
from alloc.problems.missions.files.faults import MAX_FAULTS, mission_faults

GOOD = {
    "format": "alloc-mission/1",
    "agents": [{"id": "a1", "ability": 4}, {"id": "a2", "ability": 3}],
    "tasks": [{"id": "t1", "workload": 20}, {"id": "t2", "workload": 5}],
    "events": [
        {"hour": 1.0, "event": "agent-recalled", "agent": "a1"},
        {"hour": 2.0, "event": "agent-returns", "agent": "a1"},
        {"hour": 3.0, "event": "task-changes", "task": "t1", "workload": 5.0},
    ],
}


def faulty(**changes):
    """Return the good document with values at places such as ``agents_0_ability``."""
    document = copy.deepcopy(GOOD)
    for path, value in changes.items():
        *way, last = [int(step) if step.isdecimal() else step for step in path.split("__")]
        place = document
        for step in way:
            place = place[step]
        place[last] = value
    return document


def places(document):
    return [fault.place for fault in mission_faults(document)[1]]


def test_each_fault_is_reported_with_its_place():
    """Faults in settings, agents, tasks and events are all found, each at its place in the original document."""
    document = faulty(
        sensing=-1,
        agents__1__abilty=3,
        agents__1__joins=-2,
        tasks__0__workload="much",
        tasks__1__deadline=0,
        events__0__hour=-1,
        events__2__workload=None,
    )
    assert sorted(places(document)) == [
        "agents[1]",
        "agents[1].joins",
        "events[0].hour",
        "events[2].workload",
        "sensing",
        "tasks[0].workload",
        "tasks[1].deadline",
    ]


def test_consequences_of_a_fault_are_not_reported():
    """An event that is impossible only because a faulty one was removed is not reported."""
    assert places(faulty(events__0__agent="a9")) == ["events[0].agent"]
    assert places(faulty(events__1__agent="a2")) == ["events[1]"]


def test_first_fault_matches_the_reader():
    """The first error is the one that reading the mission raises."""
    for document in (faulty(seed=0.5), faulty(tasks=[]), faulty(format="alloc-mission/2"), [], faulty(pace={"low": 9})):
        with pytest.raises(InputError) as caught:
            mission_from_document(document)
        assert str(mission_faults(document)[1][0]) == str(caught.value)


def test_repeated_fields_are_faults():
    """A repeated field in an object is a fault, and later faults are still found."""
    text = (
        json.dumps(GOOD)
        .replace('"id": "a1", ', '"id": "a1", "id": "a1", ')
        .replace('"workload": 20', '"workload": -20')
    )
    assert places(json_text.parse(text)) == ["agents[0]", "tasks[0].workload"]


def test_valid_mission_is_returned():
    """Without faults, the mission is the one that the reader returns."""
    drawn = mission_to_document(random_mission(MissionParameters(family="failures"), 3))
    mission, faults = mission_faults(drawn)
    assert faults == []
    assert mission_to_document(mission) == drawn


def test_number_of_reported_faults_is_limited():
    """Of very many faults only the first ones are reported, and the given document is not modified."""
    document = faulty(events=[{"hour": -1, "event": "agent-fails", "agent": "a1"}] * 50)
    before = copy.deepcopy(document)
    assert len(places(document)) == MAX_FAULTS
    assert document == before


@pytest.mark.parametrize("seed", [math.nan, math.inf, 1.5, -1, True, "1", 2**63])
def test_a_seed_is_a_whole_number(seed):
    """Also NaN and infinity, which JSON of Python and of numpy may hold, are an error at `seed`."""
    assert places({**GOOD, "seed": seed}) == ["seed"]
