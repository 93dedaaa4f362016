"""Fewest unserved tasks, repair of allocations, and competing tasks, compared with brute force."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given
from oracle import brute_force, reachable
from strategies import allocated, instances

from alloc.problems import (
    Allocation,
    Instance,
    evaluate,
    fewest_unserved,
    minimal_unservable_set,
    serve_all,
)


def can_all_be_served(instance: Instance, tasks: tuple[int, ...]) -> bool:
    """Return whether each of `tasks` can have its own agent, by brute force."""
    _, able = reachable(instance)

    def place(rest: tuple[int, ...], used: frozenset[int]) -> bool:
        return not rest or any(
            able[i, rest[0]] and place(rest[1:], used | {i}) for i in range(instance.n) if i not in used
        )

    return place(tasks, frozenset())


@given(instances(most_agents=4, most_tasks=3))
def test_fewest_unserved_matches_brute_force(instance: Instance) -> None:
    """The number by matching equals that by brute force."""
    assert fewest_unserved(instance) == brute_force(instance).unserved


@given(allocated())
def test_serve_all_leaves_fewest_tasks_unserved(case: tuple[Instance, Allocation]) -> None:
    """Afterwards the fewest tasks are unserved, served ones stay served, and all rules hold."""
    instance, allocation = case
    served_before = np.flatnonzero(evaluate(instance, allocation).group_ability > 0)
    answer = serve_all(instance, allocation)
    score = evaluate(instance, answer)
    assert not score.violations
    assert len(score.unserved_tasks) == fewest_unserved(instance)
    assert not set(score.unserved_tasks) & set(served_before.tolist())


@given(allocated())
def test_serve_all_is_idempotent(case: tuple[Instance, Allocation]) -> None:
    """Doing it twice is doing it once."""
    instance, allocation = case
    once = serve_all(instance, allocation)
    assume(not evaluate(instance, once).unserved_tasks)
    assert serve_all(instance, once) == once


@given(instances())
def test_unservable_set_is_inclusion_minimal(instance: Instance) -> None:
    """The set cannot be served, but every proper subset can, and one agent too few can take any of its tasks."""
    tasks = minimal_unservable_set(instance)
    needed = tuple(np.flatnonzero(instance.workload > 0).tolist())
    assert (tasks is None) == can_all_be_served(instance, needed)
    if tasks is not None:
        rivals = tuple(tasks.tolist())
        assert set(rivals) <= set(needed)
        assert not can_all_be_served(instance, rivals)
        assert all(can_all_be_served(instance, part) for part in combinations(rivals, len(rivals) - 1))
        assert reachable(instance)[1][:, rivals].any(axis=1).sum() == len(rivals) - 1


def test_contested_tasks_match_hand_calculation(contested: Instance) -> None:
    """Three tasks share two agents; the fourth has its own."""
    tasks = minimal_unservable_set(contested)
    assert tasks is not None
    assert tasks.tolist() == [0, 1, 3]
    assert fewest_unserved(contested) == 1


def test_augmenting_path_matches_hand_calculation() -> None:
    """Task 2 needs agent 0, which must leave task 0 to agent 1, which must leave task 1 to the idle agent 2."""
    instance = Instance(ability=[1, 1, 1], workload=[1, 1, 1], allowed_tasks=[[0, 2], [0, 1], [1]])
    assert serve_all(instance, Allocation([0, 1, -1])) == Allocation([2, 0, 1])


def test_idle_agents_are_taken_first() -> None:
    """A task gets the nearest idle agent before a working one."""
    instance = Instance(
        ability=[1, 1, 1, 1],
        workload=[9, 1],
        agent_position=[[5, 0], [5, 0], [3, 0], [2, 0]],
        task_position=[[5, 0], [0, 0]],
    )
    assert serve_all(instance, Allocation([0, 0, -1, -1])) == Allocation([0, 0, -1, 1])


@pytest.mark.parametrize("agents", [1, 2, 5])
def test_unlimited_agents_serve_as_many_tasks(agents: int) -> None:
    """If all agents can take all tasks, n agents serve n tasks."""
    instance = Instance(ability=np.ones(agents), workload=[1, 0, 1, 1])
    assert fewest_unserved(instance) == max(0, 3 - agents)
    assert len(evaluate(instance, serve_all(instance, Allocation.idle(instance))).unserved_tasks) == max(0, 3 - agents)


@pytest.mark.parametrize(("agents", "tasks", "lists"), [(40, 60, 2), (60, 60, 2), (55, 60, 3), (1000, 2000, 50)])
def test_failed_searches_do_not_affect_later_ones(agents: int, tasks: int, lists: int) -> None:
    """All servable tasks are served, and thousands of failed searches are cheap."""
    rng = np.random.default_rng(agents)
    for _ in range(5):
        allowed = rng.integers(0, tasks, (agents, lists)).tolist()
        instance = Instance(ability=np.ones(agents), workload=np.ones(tasks), allowed_tasks=allowed)
        served = evaluate(instance, serve_all(instance, Allocation.idle(instance)))
        assert len(served.unserved_tasks) == fewest_unserved(instance) > 0
