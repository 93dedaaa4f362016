"""Agents of equal ability swap tasks to reduce the distance."""

import numpy as np
import pytest
from hypothesis import given
from strategies import allocated

from alloc.allocators import solve
from alloc.allocators.heuristic.greedy.swaps import reduce_distance
from alloc.problems import Allocation, Instance, evaluate, paper


def never() -> bool:
    return False


@given(allocated(speeds=False))
def test_swaps_keep_abilities_and_never_increase_distance(case: tuple[Instance, Allocation]) -> None:
    """Each task keeps the abilities assigned to it, and the total distance does not increase."""
    instance, allocation = case
    free = Instance(
        ability=instance.ability,
        workload=instance.workload,
        agent_position=instance.start_position,
        task_position=instance.task_position,
    )
    task = allocation.task_of_agent
    changed = reduce_distance(free, task, never)
    for j in range(-1, instance.m):
        assert sorted(instance.ability[changed == j]) == sorted(instance.ability[task == j])
    assert evaluate(free, Allocation(changed)).distance <= evaluate(free, allocation).distance


def test_swaps_match_hand_calculation() -> None:
    """On a line, equal agents take the tasks in their own order; the one with another ability stays."""
    instance = Instance(
        ability=[1, 1, 1, 2],
        workload=[1, 1, 1],
        agent_position=[[0, 0], [1, 0], [2, 0], [3, 0]],
        task_position=[[0, 0], [1, 0], [2, 0]],
    )
    assert reduce_distance(instance, np.array([2, 0, 1, 0]), never).tolist() == [0, 1, 2, 0]


def test_interrupted_swaps_never_increase_distance() -> None:
    """If interrupted at once, the distance has not increased."""
    instance = paper(1, 0)
    task = np.random.default_rng(0).integers(0, instance.m, instance.n)
    changed = reduce_distance(instance, task, lambda: True)
    assert evaluate(instance, Allocation(changed)).distance <= evaluate(instance, Allocation(task)).distance


@pytest.mark.parametrize("scenario", [1, 4])
def test_greedy_saves_energy_if_in_the_objective(scenario: int) -> None:
    """The makespan is the same, the energy at least 30 % lower."""
    fast, saving = (solve(paper(scenario, 0), "greedy", objective=goal) for goal in ("makespan", "makespan-energy"))
    assert saving.makespan == pytest.approx(fast.makespan)
    assert saving.energy < 0.7 * fast.energy
