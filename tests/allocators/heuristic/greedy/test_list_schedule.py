"""Greedy list scheduling."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import instances

from alloc.allocators import Budget, Search, solve
from alloc.allocators.heuristic.greedy import list_schedule
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Allocation, Instance, Objective, Reach, evaluate, fewest_unserved
from alloc.problems.generate import Family, random_instance


def test_plan_matches_hand_calculation() -> None:
    """4 goes to the largest task, 3 to the other, 2 to the lower W/h (3/5 against 4/6), and 1 to the other again."""
    assert greedy(Instance(ability=[1, 2, 3, 4], workload=[5, 6])) == Allocation([1, 0, 0, 1])


def test_tasks_without_workload_get_no_agent() -> None:
    """All agents go to tasks with work, and none if there is no work at all."""
    assert greedy(Instance(ability=[1, 1], workload=[0, 3])) == Allocation([1, 1])
    assert greedy(Instance(ability=[1, 1], workload=[0, 0])) == Allocation([-1, -1])


@given(instances(speeds=False))
def test_heap_and_scan_agree(instance: Instance) -> None:
    """With complete reach, the heap gives the same plan as scanning all tasks."""
    free = Instance(ability=instance.ability, workload=instance.workload)
    one_task_less = [*range(instance.m)]
    scanned = Instance(
        ability=[*instance.ability, 1e-9],
        workload=[*instance.workload, 0],
        allowed_tasks=[*[one_task_less] * instance.n, []],
    )
    assert greedy(free).task_of_agent.tolist() == greedy(scanned).task_of_agent[:-1].tolist()


@given(instances())
def test_feasible_and_complete(instance: Instance) -> None:
    """No constraint is violated, and after the repair of `solve` the fewest tasks are unserved."""
    assert not evaluate(instance, greedy(instance)).violations
    result = solve(instance, "greedy")
    assert result.evaluation is not None
    assert not result.evaluation.violations
    assert len(result.evaluation.unserved_tasks) == fewest_unserved(instance)


@given(instances(most_agents=12, most_tasks=30), st.sampled_from([1.0, 1 / 3, 1e50]))
def test_tree_agrees_with_the_scan(instance: Instance, factor: float) -> None:
    """Compiled or not, each agent gets the same task: ranges, batteries, lists, travel times and unknown places."""
    instance = replace(
        instance,
        agent_position=instance.agent_position * factor,
        task_position=instance.task_position * factor,
        communication_range=instance.communication_range * factor,
        battery=np.minimum(instance.battery * factor, 1e300),
        speed=instance.speed * factor,
    )
    assume(instance.has_travel_time or not instance.reach.is_complete)  # else neither is needed
    with patch("alloc.allocators.heuristic.greedy.list_schedule.MAX_SCANNED", 0):
        by_tree = greedy(instance)
    assert by_tree == greedy(instance)


def test_a_hundred_thousand_agents_with_short_ranges() -> None:
    """Without a table of all pairs, no agent exceeds its range, and every task is served."""
    rng = np.random.default_rng(0)
    n, m = 100_000, 2_000
    instance = Instance(
        ability=rng.uniform(1, 10, n),
        workload=rng.uniform(1, 10, m),
        agent_position=rng.random((n, 3)),
        task_position=rng.random((m, 3)),
        communication_range=rng.uniform(0.1, 0.2, n),
    )
    with patch.object(Reach, "mask", property()), patch.object(Reach, "distance", property()):
        result = solve(instance, "greedy", time_limit_s=60)
    assert result.evaluation is not None
    assert not result.evaluation.violations
    assert not result.evaluation.unserved_tasks


def test_makespan_is_at_most_four_thirds_of_the_bound() -> None:
    """With equal workloads list scheduling is within 4/3 of the optimum; here compared with the bound."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        instance = Instance(ability=rng.integers(1, 10, 60), workload=np.full(5, 10.0))
        result = solve(instance, "greedy")
        assert result.makespan is not None
        assert result.makespan <= 4 / 3 * result.lower_bound + 1e-9


def test_stops_when_time_is_up() -> None:
    """Without time all agents are idle; `solve` then serves what it can."""
    instance = Instance(ability=np.ones(3000), workload=[1, 1])
    late = Search(instance, Objective.MAKESPAN, Budget(0))
    assert greedy(instance, late) == Allocation.idle(instance)
    assert solve(instance, "greedy", time_limit_s=0).makespan == pytest.approx(1.0)


def test_standalone_call_agrees_with_a_run() -> None:
    """Called without a search, agents with travel times go to the same tasks as in a run."""
    rng = np.random.default_rng(0)
    instance = Instance(
        ability=rng.uniform(1, 3, 20),
        workload=rng.uniform(5, 9, 4),
        agent_position=rng.random((20, 2)),
        task_position=rng.random((4, 2)),
        speed=np.full(20, 2.0),
    )
    search = Search(instance, Objective.MAKESPAN, Budget(None))
    assert greedy(instance) == greedy(instance, search)
    assert (greedy(instance).task_of_agent >= 0).any()


def test_parallel_assignment_is_as_even_as_sequential() -> None:
    """Threads that assign agents in parallel balance tasks about as well as one, and leave no agent out."""
    instance = random_instance(Family(agents=6000, tasks=20, communication_range=0.8), 0)
    with patch.multiple(list_schedule, MIN_SHARED=500, MAX_SCANNED=0):
        plans = [
            greedy(instance, Search(instance, Objective.MAKESPAN, Budget(None), threads=threads))
            for threads in (1, 3, 3)
        ]
    one, three = (evaluate(instance, plan) for plan in plans[:2])
    assert plans[1] == plans[2]
    assert plans[0] != plans[1]
    assert not three.violations
    assert (plans[1].task_of_agent >= 0).all() == (plans[0].task_of_agent >= 0).all()
    assert three.makespan <= 1.01 * one.makespan
