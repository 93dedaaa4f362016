"""Compiled searches for the cheapest subset of a pool of agents for one of two tasks; the other task gets the rest.

A subset is a bit mask over the pool. Its cost is that of its agents (`Workspace.cost`) plus the penalties of the
shortfalls of both tasks, which are computed from their `Needs`.
"""

import numpy as np

from alloc.allocators.heuristic.local_search.plan import MAX_SUMS, POOL_BY_HALVES, Needs, Weights, Workspace
from alloc.allocators.runtime.compiled import compiled

UNSERVED_PENALTY = 1e12
"""Penalty of a task without agents, larger than all others."""

LOOKAHEAD = 8
"""Number of subsets of the second half considered for each subset of the first, from the smallest sufficient one."""

UNREACHABLE = 1e300
"""Cost of a sum of abilities that no subset attains."""


@compiled
def penalty(weights: Weights, price: float, shortfall: float, is_unserved: bool) -> float:
    """Return the penalty of the shortfall of one task."""
    if shortfall <= 0.0:
        return 0.0
    return weights.short_task + price * weights.shortfall * shortfall + (UNSERVED_PENALTY if is_unserved else 0.0)


@compiled
def best_by_sums(
    work: Workspace,
    weights: Weights,
    pool: int,
    largest_sum: int,
    total: float,
    needs: Needs,
) -> np.uint64:
    """Return the cheapest subset by dynamic programming over integer sums of abilities.

    For increasing k, the cheapest subset of the first k agents is computed for each sum up to `largest_sum`. Indices
    are unsigned, which avoids checks for negative indices.
    """
    missing, other_missing, price, other_price, all_in_pool, other_all_in_pool = needs
    cost, sets, sizes, costs = work.sum_cost, work.sum_set, work.ability, work.cost
    old, new = np.uint64(0), np.uint64(MAX_SUMS)
    one, top = np.uint64(1), np.uint64(0)
    last = np.uint64(largest_sum)
    cost[0], sets[0] = 0.0, np.uint64(0)
    for index in range(pool):
        size, extra, bit = np.uint64(sizes[index]), costs[index], one << np.uint64(index)
        reach = min(last, top + size)
        for entry in range(top + one, reach + one):
            cost[old + entry], sets[old + entry] = UNREACHABLE, np.uint64(0)
        for entry in range(np.uint64(0), min(size, reach + one)):
            cost[new + entry], sets[new + entry] = cost[old + entry], sets[old + entry]
        for entry in range(size, reach + one):
            without, with_it = cost[old + entry], cost[old + entry - size] + extra
            cheaper = with_it < without
            cost[new + entry] = with_it if cheaper else without
            sets[new + entry] = (sets[old + entry - size] | bit) if cheaper else sets[old + entry]
        top = reach
        old, new = new, old
    best, subset = np.inf, np.uint64(0)
    for entry in range(int(top) + 1):
        value = cost[old + np.uint64(entry)] + penalty(weights, price, missing - entry, all_in_pool and entry == 0)
        value += penalty(weights, other_price, other_missing - (total - entry), other_all_in_pool and entry == total)
        if value < best:
            best, subset = value, sets[old + np.uint64(entry)]
    return subset


@compiled
def best_by_enumeration(work: Workspace, weights: Weights, pool: int, needs: Needs) -> np.uint64:
    """Return the cheapest of all 2^pool subsets."""
    missing, other_missing, price, other_price, all_in_pool, other_all_in_pool = needs
    ability, other, cost = work.subset_ability, work.subset_other_ability, work.subset_cost
    ability[0], cost[0], other[0] = 0.0, 0.0, 0.0
    for index in range(pool):
        other[0] += work.other_ability[index]
    for index in range(pool):
        half = 1 << index
        more, less, extra = work.ability[index], work.other_ability[index], work.cost[index]
        for entry in range(half):
            ability[half + entry] = ability[entry] + more
            other[half + entry] = other[entry] - less
            cost[half + entry] = cost[entry] + extra
    count = 1 << pool
    best, subset = np.inf, 0
    for entry in range(count):
        shortfall, other_shortfall = missing - ability[entry], other_missing - other[entry]
        value = cost[entry]
        if shortfall > 0.0:
            value += penalty(weights, price, shortfall, all_in_pool and entry == 0)
        if other_shortfall > 0.0:
            value += penalty(weights, other_price, other_shortfall, other_all_in_pool and entry == count - 1)
        if value < best:
            best, subset = value, entry
    return np.uint64(subset)


@compiled
def sorted_subsets(work: Workspace, begin: int, count: int, base: int) -> int:
    """Write all subsets of `count` agents of the pool, sorted by ability, from `base` on; return their number."""
    ability, other = work.subset_ability, work.subset_other_ability
    cost, bits = work.subset_cost, work.subset_bits
    buffer = 2 << (POOL_BY_HALVES // 2)
    ability[base], other[base], cost[base], bits[base] = 0.0, 0.0, 0.0, 0
    size = 1
    for index in range(begin, begin + count):
        more, less, price, bit = work.ability[index], work.other_ability[index], work.cost[index], 1 << index
        without, with_it = base, base
        for entry in range(buffer, buffer + 2 * size):
            if with_it == base + size or (without < base + size and ability[without] <= ability[with_it] + more):
                ability[entry], other[entry] = ability[without], other[without]
                cost[entry], bits[entry] = cost[without], bits[without]
                without += 1
            else:
                ability[entry], other[entry] = ability[with_it] + more, other[with_it] + less
                cost[entry], bits[entry] = cost[with_it] + price, bits[with_it] | bit
                with_it += 1
        size *= 2
        for entry in range(size):
            ability[base + entry], other[base + entry] = ability[buffer + entry], other[buffer + entry]
            cost[base + entry], bits[base + entry] = cost[buffer + entry], bits[buffer + entry]
    return size


@compiled
def best_by_halves(work: Workspace, weights: Weights, pool: int, needs: Needs) -> np.uint64:
    """Return the cheapest of the subsets that just suffice, by meeting in the middle.

    The subsets of both halves of the pool are sorted; those of the second half that complete each subset of the first
    are then found in one pass.

    References
    ----------
    Horowitz and Sahni (1974), doi:10.1145/321812.321823.
    """
    missing, other_missing, price, other_price, _, _ = needs
    ability, other = work.subset_ability, work.subset_other_ability
    cost, bits = work.subset_cost, work.subset_bits
    middle = 1 << (POOL_BY_HALVES // 2)
    size = sorted_subsets(work, 0, pool // 2, 0)
    other_size = sorted_subsets(work, pool // 2, pool - pool // 2, middle)
    total = 0.0
    for index in range(pool):
        total += work.other_ability[index]
    best, subset, enough = np.inf, 0, other_size
    for entry in range(size):
        while enough > 0 and ability[entry] + ability[middle + enough - 1] >= missing:
            enough -= 1
        for fit in range(middle + max(0, enough - 1), middle + min(other_size, enough + LOOKAHEAD)):
            value = cost[entry] + cost[fit] + penalty(weights, price, missing - ability[entry] - ability[fit], False)
            value += penalty(weights, other_price, other_missing - (total - other[entry] - other[fit]), False)
            if value < best:
                best, subset = value, bits[entry] | bits[fit]
    return np.uint64(subset)
