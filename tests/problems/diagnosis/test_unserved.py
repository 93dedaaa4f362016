"""Reasons for unserved tasks."""

import numpy as np
import pytest
from tiny_instances import scarce_instance, varied_instance

from alloc.allocators import solve
from alloc.problems import Allocation, DistanceTable, Instance, evaluate
from alloc.problems.diagnosis.unserved import MAX_TASKS, why_unserved

FLEET = Instance(
    ability=[1, 2, 1],
    workload=[3, 1, 4, 4, 2],
    agent_position=[[0, 0], [9, 0], [0, 1]],
    task_position=[[1, 0], [2, 0], [30, 0], [8, 0], [3, 3]],
    communication_range=[5, np.inf, 5],
    battery=[np.inf, 3, 50],
    priority=[5, 2, 1, 1, 0],
    skills=[["camera"], ["camera", "lift"], []],
    needs=[[], [], [], ["camera", "pump"], []],
)


def test_reasons_match_hand_calculation() -> None:
    """The nearest agent and what it lacks, or what able agents do instead; highest priorities first."""
    reasons = {FLEET.task_ids[one.task]: one.reason for one in why_unserved(FLEET, Allocation([1, -1, 0]))}
    assert reasons == {
        "t3": "no agent can take it; nearest is a1: distance 30 exceeds the range 5",
        "t4": "no agent can take it (it needs 'camera', 'pump'); nearest is a2: the agent lacks 'pump'",
        "t5": "2 agents could take it: a1 does t2 (priority 2), a3 does t1 (priority 5)",
    }
    assert (
        why_unserved(FLEET, Allocation([-1, -1, -1]), most=1)[0].reason
        == "2 agents could take it: a1 is idle, a3 is idle"
    )


def test_pinned_agents_are_reported_as_pinned() -> None:
    """Pinned agents are reported as pinned, not as idle or busy."""
    pinned = why_unserved(FLEET, Allocation([1, -1, -1]), most=1, pinned={0, 2})
    assert pinned[0].reason == "2 agents could take it: a1 is pinned to t2 (priority 2), a3 is pinned to no task"
    result = solve(FLEET, time_limit_s=2, pins={"a3": None})
    assert "a3 is pinned to no task" in str(result)
    assert any(note.startswith("besides the pinned agents, ") for note in result.notes)


def test_missing_distances_to_the_base_are_reported() -> None:
    """A task without a given distance to the agent's base is reported as such."""
    rows = [("a1", "t1", 1.0), ("a1", "t2", 2.0), ("t1", "north", 1.0)]
    table = DistanceTable.of(rows, ["a1"], ["t1", "t2"], "unreachable", ["north"])
    fleet = Instance(ability=[1], workload=[1, 1], distances=table, bases={"north": None}, return_base=[0])
    assert {one.task: one.reason for one in why_unserved(fleet, Allocation([0]))} == {
        1: "no agent can take it; nearest is a1: there is no way from it back to north in the table of distances"
    }


def test_reasons_are_in_the_summary_and_the_result() -> None:
    """The summary and the result have the reasons; a result that serves all has no such field."""
    result = solve(FLEET, time_limit_s=2)
    assert "t4 (priority 1): no agent can take it" in str(result)
    document = result.to_dict()["unserved_reasons"]
    assert isinstance(document, list)
    assert [one["task"] for one in document] == ["t3", "t4", "t5"]
    assert document[0] == {
        "task": "t3",
        "priority": 1.0,
        "able": 0,
        "able_agents": [],
        "nearest_agent": "a1",
        "reason": "no agent can take it; nearest is a1: distance 30 exceeds the range 5",
    }
    assert document[2]["able_agents"] == ["a1", "a3"]
    assert "unserved_reasons" not in solve(Instance(ability=[1], workload=[1]), "greedy").to_dict()


@pytest.mark.parametrize("seed", range(60))
def test_reasons_are_true(seed: int) -> None:
    """Agents said to be able are, the nearest is not; no able agent serves a task of lower priority."""
    for instance in (scarce_instance(seed), varied_instance(seed)):
        plan = solve(instance, "greedy", iterations=1).allocation
        assert plan is not None
        score = evaluate(instance, plan)
        found = why_unserved(instance, plan)
        assert len(found) == min(MAX_TASKS, len(score.unserved_tasks))
        for one in found:
            able = np.flatnonzero(
                [bool(instance.reach.allows(np.array([i]), np.array([one.task]))[0]) for i in range(instance.n)]
            )
            assert one.able == len(able)
            assert set(one.able_agents) <= set(able.tolist())
            assert (one.nearest is None) == bool(len(able))
            held = plan.task_of_agent[able]
            assert (instance.priority[held] >= one.priority).all()
