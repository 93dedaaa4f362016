import time

import numpy as np
import pytest
from oracle import brute_force
from tiny_instances import all_can_be_served, seeds_where, tiny_instance

from alloc.allocators import Budget, Search
from alloc.allocators.bounds import raise_makespan_bound
from alloc.allocators.exact.makespan.task_prices import bound_by_task_prices
from alloc.allocators.heuristic.greedy.list_schedule import greedy
from alloc.problems import Instance, Objective, makespan_lower_bound


def bound_of(instance: Instance, high: float) -> float:
    """Return the bound from the simple one up to `high`."""
    return bound_by_task_prices(instance, makespan_lower_bound(instance), high, time.monotonic() + 0.5, lambda: False)


@pytest.mark.parametrize("seed", seeds_where(all_can_be_served, 40))
def test_bound_never_exceeds_the_optimum(seed):
    """On tiny instances of every kind, the bound is at most the optimum of brute force."""
    instance = tiny_instance(seed)
    if instance.workload.any() and instance.reach.neighbours is not None:
        best = brute_force(instance).makespan
        assert makespan_lower_bound(instance) * (1 - 1e-12) <= bound_of(instance, 2 * best) <= best * (1 + 1e-9)


def test_bound_matches_hand_calculation():
    """Three agents of ability 1 share 9 hours of work, for which a fourth is of no use: the bound is 3 hours."""
    instance = Instance(ability=[1, 1, 1, np.pi], workload=[4, 5, 3], allowed_tasks=[*[[0, 1]] * 3, [2]])
    assert bound_of(instance, 4.0) == pytest.approx(3.0, rel=1e-3)


@pytest.mark.slow
def test_the_bound_is_used_if_a_linear_programme_is_too_large():
    """With thousands of agents of short range, the bound of a run exceeds the simple one."""
    rng = np.random.default_rng(0)
    instance = Instance(
        ability=rng.integers(1, 10, 20_000),
        workload=rng.integers(100, 900, 500),
        agent_position=rng.random((20_000, 2)) ** 2,
        task_position=rng.random((500, 2)),
        communication_range=np.full(20_000, 0.08),
    )
    search = Search(instance, Objective.MAKESPAN, Budget())
    search.submit(greedy(instance))
    raise_makespan_bound(search, time.monotonic() + 60.0)
    assert search.lower_bound > 1.01 * makespan_lower_bound(instance)


@pytest.mark.parametrize("gathered", [False, True])
def test_the_bound_does_not_depend_on_cached_neighbours(gathered, monkeypatch):
    """With too many pairs within reach to gather in time there is no bound, even if they are cached."""
    monkeypatch.setattr("alloc.allocators.bounds.GATHERED_PER_SECOND", 1)
    monkeypatch.setattr("alloc.allocators.bounds.LP_SIZE_LIMIT", 1)
    monkeypatch.setattr("alloc.problems.distances.reach.TABLE_LIMIT", 1)
    instance = Instance(ability=[1, 1, 1, np.pi], workload=[4, 5, 3], allowed_tasks=[*[[0, 1]] * 3, [2]])
    search = Search(instance, Objective.MAKESPAN, Budget())
    search.submit(greedy(instance))
    before = search.lower_bound
    if gathered:
        assert instance.reach.neighbours is not None
    raise_makespan_bound(search, time.monotonic() + 60.0)
    assert search.lower_bound == before
