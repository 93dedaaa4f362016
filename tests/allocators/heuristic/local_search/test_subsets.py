"""The cheapest subset of a pool, against the definition of its cost."""

import numpy as np
import pytest

from alloc.allocators.heuristic.local_search.plan import Needs, Weights, workspace
from alloc.allocators.heuristic.local_search.subsets import (
    best_by_enumeration,
    best_by_halves,
    best_by_sums,
    sorted_subsets,
)

WEIGHTS = Weights(cost=1.0, noise=0.0, short_task=3.0, shortfall=0.7, surplus=2.0, integer_ability=10.0)


def pool_of(seed, size, *, integer):
    rng = np.random.default_rng(seed)
    work = workspace(seed)
    ability = rng.integers(1, 9, size) if integer else rng.uniform(0.5, 8, size)
    work.ability[:size] = work.other_ability[:size] = ability
    work.cost[:size] = rng.normal(size=size)
    missing = float(rng.integers(1, 4 * size)) if integer else rng.uniform(1, 4 * size)
    other_missing = float(ability.sum()) - missing - float(rng.integers(-2, 4))
    return work, Needs(missing, other_missing, *rng.uniform(0.5, 2, 2), False, False)


def cost_of(work, size, subset, needs, weights):
    """Return the cost of a subset for the first task, from the definition."""
    goes = np.array([int(subset) >> bit & 1 for bit in range(size)], dtype=bool)
    cost = float(work.cost[:size][goes].sum())
    for shortfall, price in (
        (needs.missing - work.ability[:size][goes].sum(), needs.price),
        (needs.other_missing - work.other_ability[:size][~goes].sum(), needs.other_price),
    ):
        cost += weights.short_task + price * weights.shortfall * shortfall if shortfall > 0 else 0.0
    return cost


def least_cost(work, size, needs, weights):
    return min(cost_of(work, size, subset, needs, weights) for subset in range(1 << size))


@pytest.mark.parametrize("seed", range(20))
def test_enumeration_finds_the_cheapest_subset(seed):
    """Enumeration finds the cheapest subset."""
    size = 1 + seed % 8
    work, needs = pool_of(seed, size, integer=False)
    subset = best_by_enumeration(work, WEIGHTS, size, needs)
    found = cost_of(work, size, subset, needs, WEIGHTS)
    assert found == pytest.approx(least_cost(work, size, needs, WEIGHTS))


@pytest.mark.parametrize("seed", range(20))
def test_dynamic_programming_finds_the_cheapest_subset(seed):
    """Dynamic programming over sums is exact for integer abilities."""
    size = 1 + seed % 8
    work, needs = pool_of(seed, size, integer=True)
    total = float(work.ability[:size].sum())
    subset = best_by_sums(work, WEIGHTS, size, int(total), total, needs)
    found = cost_of(work, size, subset, needs, WEIGHTS)
    assert found == pytest.approx(least_cost(work, size, needs, WEIGHTS))


@pytest.mark.parametrize("seed", range(20))
def test_meet_in_the_middle_finds_the_least_shortfall(seed):
    """If agents cost nothing, meet-in-the-middle search minimises the shortfall."""
    size = 2 + seed % 8
    work, needs = pool_of(seed, size, integer=False)
    work.cost[:size] = 0.0
    needs = needs._replace(price=1.0, other_price=1.0)
    weights = WEIGHTS._replace(short_task=0.0)
    subset = best_by_halves(work, weights, size, needs)
    found = cost_of(work, size, subset, needs, weights)
    assert found == pytest.approx(least_cost(work, size, needs, weights))


def test_no_task_is_left_unserved():
    """A task never loses its last agent, at any cost."""
    work = workspace(0)
    work.ability[0], work.other_ability[0], work.cost[0] = 1.0, 1.0, 1e6
    needs = Needs(1e-9, 0.0, 1.0, 1.0, True, False)
    assert best_by_enumeration(work, WEIGHTS, 1, needs) == 1
    assert best_by_sums(work, WEIGHTS, 1, 1, 1.0, needs) == 1


def test_subsets_are_sorted():
    """All subsets are listed, sorted by ability, each with its own cost."""
    work, *_ = pool_of(3, 7, integer=False)
    size = sorted_subsets(work, 2, 5, 0)
    assert size == 32
    assert (np.diff(work.subset_ability[:size]) >= 0).all()
    for entry in range(size):
        goes = [bit for bit in range(7) if work.subset_bits[entry] >> bit & 1]
        assert work.subset_ability[entry] == pytest.approx(work.ability[goes].sum())
        assert work.subset_cost[entry] == pytest.approx(work.cost[goes].sum())
    assert len(set(work.subset_bits[:size].tolist())) == size
