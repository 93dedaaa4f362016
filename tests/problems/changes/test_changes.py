"""Agents and tasks are added, removed and moved: the changed instance agrees with the changed fields."""

import numpy as np
import pytest
from oracle import flight_energies, reachable
from tiny_instances import varied_instance

from alloc.problems import DistanceTable, InputError, Instance
from alloc.problems.formats import from_document, to_document

SEEDS = range(60)


def same_reach(instance: Instance) -> None:
    """Return whether the reach agrees with the definitions."""
    distance, able = reachable(instance)
    agents, tasks = np.indices((instance.n, instance.m)).reshape(2, -1)
    np.testing.assert_array_equal(instance.reach.allows(agents, tasks), able.ravel())
    np.testing.assert_allclose(instance.reach.distance_of(agents, tasks), distance.ravel(), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_changes_match_the_definitions(seed: int) -> None:
    """After each change, reachability and distances agree with the fields; copies equal their models."""
    instance = varied_instance(seed)
    more = instance.with_agents([{"id": "copy", "like": "a1"}, {"id": "blank", "ability": 2}])
    same_reach(more)
    distance, able = reachable(more)
    np.testing.assert_array_equal(distance[instance.n], distance[0])
    np.testing.assert_array_equal(able[instance.n], able[0])
    np.testing.assert_array_equal(flight_energies(more, distance)[instance.n], flight_energies(more, distance)[0])
    assert np.isnan(more.start_position[-1]).all()
    same_reach(more.with_tasks([{"id": "new", "workload": 3, "position": instance.task_position[0][:2]}]))
    same_reach(more.moved_to({"a1": "t2", "copy": instance.task_position[0].tolist()}))
    same_reach(more.without_agents(["a1"]))


@pytest.mark.parametrize("seed", SEEDS)
def test_moved_agents_return_to_their_original_start(seed: int) -> None:
    """Distances home are unchanged after moves to a place or a task, with or without given distances."""
    instance = varied_instance(seed, {"metric", "distances", "returns", "bases"} if seed % 2 else None)
    moved = instance.moved_to({"a1": "t2", "a2": instance.task_position[0].tolist()})
    assert moved.returns.tolist() == instance.returns.tolist()
    same_reach(moved)
    same_reach(from_document(to_document(moved)))
    back = [flight_energies(one, np.zeros((one.n, one.m))) for one in (instance, moved, moved.moved_to({"a1": "t1"}))]
    np.testing.assert_allclose(back[1], back[0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(back[2], back[0], rtol=1e-9, atol=1e-9)


def test_agents_that_started_together_share_a_base() -> None:
    """It is named after the first agent, unless that name is taken; agents that do not return have none."""
    instance = Instance(
        ability=[1] * 4,
        workload=[1],
        agent_position=[[0, 0]] * 4,
        task_position=[[3, 4]],
        returns=[True, True, False, True],
        bases={"start of a1": (9, 9)},
    )
    moved = instance.moved_to({"a1": [3, 0], "a2": [3, 1], "a3": [3, 2]})
    assert moved.bases.ids == ("start of a1", "start of a1 (2)")
    assert moved.return_base.tolist() == [1, 1, -1, -1]
    assert moved.reach.cost[moved.reach.origin, 0].tolist() == [4 + 5, 3 + 5, 2, 5 + 5]


def test_new_agents_return_to_the_given_base() -> None:
    """They return to a base by its id, to their start, or to the base of the copied agent."""
    instance = Instance(ability=[1], workload=[1], bases={"north": (0, 1)}, return_base=[0])
    rows = [{"id": "b", "like": "a1"}, {"id": "c", "like": "a1", "returns": True}, {"id": "d", "ability": 1}]
    more = instance.with_agents([*rows, {"id": "e", "ability": 1, "returns": "north"}])
    assert more.returns.tolist() == [True, True, True, False, True]
    assert more.return_base.tolist() == [0, 0, -1, -1, 0]


@pytest.mark.parametrize("seed", SEEDS)
def test_without_tasks_nobody_moves(seed: int) -> None:
    """Agents that start at a removed task keep its place and given distances."""
    instance = varied_instance(seed)
    fewer = instance.without_tasks(["t1"])
    distance, able = reachable(instance)
    agents, tasks = np.indices((fewer.n, fewer.m)).reshape(2, -1)
    np.testing.assert_array_equal(fewer.reach.allows(agents, tasks), able[:, 1:].ravel())
    np.testing.assert_allclose(fewer.reach.distance_of(agents, tasks), distance[:, 1:].ravel(), rtol=1e-9, atol=1e-9)
    same_reach(fewer)  # by its fields alone, as after another change, or from a file
    same_reach(from_document(to_document(fewer)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda one: one.with_agents([{"id": "x", "abilty": 3}]), "unknown field 'abilty' .did you mean 'ability'"),
        (lambda one: one.with_agents([{"id": "x", "like": "a9"}]), "no agent 'a9'"),
        (lambda one: one.with_agents([{"id": "a1", "ability": 1}]), "used twice"),
        (lambda one: one.with_agents([{"id": "x"}]), "ability"),
        (lambda one: one.with_agents([{"ability": 1}]), "agents.id: must be a string"),
        (lambda one: one.with_agents([{"id": "x", "ability": "3"}]), r"agents\[2\].ability: must be a finite number"),
        (lambda one: one.with_agents([{"id": "x", "ability": 3, "returns": "no"}]), "no base 'no'; give True"),
        (lambda one: one.with_agents([{"id": "x", "ability": 3, "skills": 5}]), "skills"),
        (lambda one: one.with_agents([{"id": "x", "ability": 3, "start_task": ["t1"]}]), "no task"),
        (lambda one: one.moved_to([("a1", "t1")]), "places"),
        (lambda one: one.with_tasks([{"id": "x"}]), "workload"),
        (lambda one: one.with_tasks([{"id": "t1", "workload": 1}]), "used twice"),
        (lambda one: one.without_tasks(["t1", "t2"]), "at least one task"),
        (lambda one: one.without_agents(["a1", "a2"]), "at least one agent"),
        (lambda one: one.moved_to({"a1": "t9"}), "no task 't9'"),
        (lambda one: one.moved_to({"a1": [1.0]}), "must be 2 or 3 numbers"),
    ],
)
def test_invalid_changes_are_refused(change, message: str) -> None:
    """Invalid changes are refused."""
    instance = Instance(ability=[1, 2], workload=[3, 4], task_position=[[0, 0], [1, 1]], start_task=[0, 1])
    with pytest.raises(InputError, match=message):
        change(instance)


def test_copies_share_given_distances() -> None:
    """Given distances of an agent also apply to its copies, in both directions; a new agent has none."""
    table = DistanceTable.of([("a1", "t1", 5.0), ("t2", "a1", 7.0)], ["a1"], ["t1", "t2"], missing="unreachable")
    instance = Instance(ability=[1], workload=[1, 1], distances=table)
    more = instance.with_agents([{"id": "c", "like": "a1"}, {"id": "b", "ability": 1}])
    assert more.reach.distance[more.reach.origin].tolist() == [[5, 7], [5, 7], [0, 0]]
    assert more.reach.mask[more.reach.origin].tolist() == [[True, True], [True, True], [False, False]]
