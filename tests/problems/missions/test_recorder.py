"""The recorded course of a mission agrees with its simulation and is complete."""

import math
from itertools import pairwise

import numpy as np
import pytest

from alloc.allocators import simulate
from alloc.problems import Event, Instance, Mission, MissionParameters, Recorder, course_of, random_mission
from alloc.problems.missions.simulation.state import AgentStatus, TaskStatus


@pytest.mark.parametrize("family", ["failures", "recharging", "growth", "deadlines", "silence"])
def test_course_agrees_with_the_simulation(family: str) -> None:
    """Legs have no gaps and add up to the distance flown, and tasks end as in the result."""
    mission = random_mission(MissionParameters(family=family, agents=4, tasks=6, loss=0.2), seed=3)
    run = simulate(mission, "greedy")
    course = course_of(run.log)
    flown = 0.0
    for legs in course.legs:
        assert all(one.end == other.begin and one.goal == other.source for one, other in pairwise(legs))
        assert legs[-1].end == course.end
        flown += sum(math.dist(leg.source, leg.goal) for leg in legs)  # type: ignore[arg-type]
    assert flown <= run.result.distance * (1 + 1e-9)
    (last,) = zip(*course.statuses(np.array([course.end])), strict=True)
    assert last.count(TaskStatus.DONE) == run.result.tasks_done
    assert last.count(TaskStatus.MISSED) == run.result.tasks_missed


def test_recording_changes_nothing() -> None:
    """A recorder of agents' knowledge does not change the simulation."""
    mission = random_mission(MissionParameters(family="silence", agents=5, tasks=6, loss=0.3), seed=1)
    recorder = Recorder(with_knowledge=True)
    recorded = simulate(mission, "hedonic", seed=2, observe=recorder)
    assert recorded.log.records == simulate(mission, "hedonic", seed=2).log.records
    assert recorder.course(recorded.result).awareness is not None


def test_work_left_follows_appearance_growth_change_and_work() -> None:
    """0 before the task appears, then 1 more per hour until an agent works, then 3 less per hour; changes are jumps."""
    instance = Instance(
        ability=[3], speed=[1], agent_position=[[0, 0]], workload=[6], task_position=[[2, 0]], task_ids=["dam"]
    )
    mission = Mission(instance, appears=[1], growth=[1], events=[Event(4, "task-changes", task="dam", workload=9)])
    course = course_of(simulate(mission, "nearest").log)
    hours = np.array([0.5, 1, 2, 3, 3.5, 4, 5, 7])
    assert course.work_left(hours).tolist() == [pytest.approx([0, 6, 7, 8, 6.5, 9, 6, 0])]
    assert [(leg.status, leg.begin, leg.end) for leg in course.legs[0]] == [
        (AgentStatus.IDLE, 0, 1),
        (AgentStatus.FLYING, 1, 3),
        (AgentStatus.WORKING, 3, 7),
    ]
    leg = course.leg(0, 2.0)
    assert leg is not None
    assert leg.position(2.0) == (1, 0, 0)
