from itertools import product

import numpy as np
import pytest

from alloc.allocators.exact.makespan.repartition.partition import (
    MAX_POOL,
    MAX_TASKS,
    best_partition,
    search_repartitions,
)
from alloc.allocators.exact.makespan.repartition.search import partners_of


def shortfall(value: np.ndarray, base: np.ndarray, need: np.ndarray, goal: tuple[int, ...]) -> float:
    has = base + [sum(value[q, p] for p, g in enumerate(goal) if g == q) for q in range(len(base))]
    return float(np.maximum(0, need - has).sum())


@pytest.mark.parametrize("tasks", [2, 3, 4])
@pytest.mark.parametrize("seed", range(5))
def test_partition_is_optimal(tasks, seed):
    """No partition of six agents with limited reach has a smaller shortfall; each agent is used once."""
    rng = np.random.default_rng(seed)
    value = np.zeros((MAX_TASKS, MAX_POOL))
    value[:tasks, :6] = rng.integers(1, 20, 6) * (rng.random((tasks, 6)) < 0.8)
    base, need = rng.integers(0, 5, tasks).astype(float), rng.integers(10, 40, tasks).astype(float)
    best = min(shortfall(value, base, need, goal) for goal in product(range(tasks), repeat=6))
    chosen, sums = np.zeros(MAX_TASKS, dtype=np.int64), np.empty((MAX_TASKS + 1, 1 << MAX_POOL))
    found = best_partition(value, base, need, tasks, 6, need.sum(), sums, np.ones(1, dtype=np.uint64), chosen)
    assert found == best
    assert sorted(q for p in range(6) for q in range(tasks) if chosen[q] >> p & 1) == sorted(
        q for q in range(tasks) for _ in range(int(chosen[q]).bit_count())
    )
    goal = tuple(next(q for q in range(tasks) if chosen[q] >> p & 1) for p in range(6))
    assert shortfall(value, base, need, goal) == best


def test_no_partition_within_the_limit():
    """If the shortfall of every partition exceeds the limit, none is chosen."""
    value, sums = np.ones((MAX_TASKS, MAX_POOL)), np.empty((MAX_TASKS + 1, 1 << MAX_POOL))
    chosen = np.full(MAX_TASKS, -1)
    state = np.ones(1, dtype=np.uint64)
    assert best_partition(value, np.zeros(2), np.full(2, 9.0), 2, 4, 1.0, sums, state, chosen) == np.inf
    assert (chosen == -1).all()


def test_shortfall_never_grows():
    """The shortfall never grows, agents out of reach add nothing, and the best assignment is reported."""
    rng = np.random.default_rng(2)
    work = np.repeat(rng.integers(1, 100, 30).astype(float)[:, None], 12, axis=1) * (rng.random((30, 12)) < 0.7)
    need = np.full(12, np.floor(work.max(axis=1).sum() / 12))
    place, state, before = work.argmax(axis=1), np.ones(1, dtype=np.uint64), np.inf
    for _ in range(20):
        total, part, best = search_repartitions(work, need, partners_of(work), place, 20, state)
        has = np.bincount(place, weights=work[np.arange(30), place], minlength=12)
        assert total == pytest.approx(np.maximum(0, need - has).sum())
        assert total <= before
        at_best = np.bincount(best, weights=work[np.arange(30), best], minlength=12)
        assert part == pytest.approx((at_best / need).min())
        before = total


def test_perfect_partition_is_found():
    """A perfect partition into twenty equal tasks is found."""
    rng = np.random.default_rng(0)
    cuts = np.sort(rng.integers(1, 1000, (20, 2)), axis=1)
    ability = np.diff(np.column_stack([np.zeros(20), cuts, np.full(20, 1000)]), axis=1).ravel()
    work = np.repeat(rng.permutation(ability[ability > 0])[:, None], 20, axis=1)
    place, need = rng.integers(0, 20, len(work)), np.full(20, 1000.0 - 2)
    assert search_repartitions(work, need, partners_of(work), place, 20_000, np.ones(1, dtype=np.uint64))[0] == 0.0
