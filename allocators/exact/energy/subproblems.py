"""The subproblems of the Lagrangian relaxation: the cheapest group of each task at given prices; compiled."""

import numpy as np

from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.knapsack import WholeArray, fill_table, read_group
from alloc.allocators.exact.knapsack_core import cheapest_by_core
from alloc.allocators.exact.knapsack_states import MAX_STATES, cheapest_by_states, room_for_states
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray


def solve_subproblems(
    model: EnergyModel, price: FloatArray, *, compare: bool = True
) -> tuple[WholeArray, FloatArray, float]:
    """Find the cheapest group of every task, or cluster, separately.

    Parameters
    ----------
    price : ndarray, shape (p,)
        Cost of one agent of each pair.
    compare : bool
        Whether to compute the excess.

    Returns
    -------
    ndarray of int, shape (p,)
        Agents of each pair in these groups.
    ndarray, shape (p,) or (0,)
        Excess: a lower bound on the extra cost of the best group with an agent of the pair.
    float
        Total cost of all groups, or a lower bound on it; ``inf`` if a task has none, and the arrays are then undefined.
    """
    group, excess = np.zeros(len(price), dtype=np.int64), np.zeros(len(price) if compare else 0)
    if model.is_whole:
        weight, need = model.weight.astype(np.int64, copy=False), model.need.astype(np.int64, copy=False)
        total = solve_all(model.first, weight, model.copies, price, need, model.max_weight, group, excess)
    else:
        part, whole = model.weight.astype(np.float64, copy=False), model.need.astype(np.float64, copy=False)
        total = solve_in_floats(model.first, part, model.copies, price, whole, group, excess)
    return group, excess, total


@compiled
def solve_in_floats(
    first: WholeArray,
    weight: FloatArray,
    copies: WholeArray,
    price: FloatArray,
    need: FloatArray,
    group: WholeArray,
    excess: FloatArray,
) -> float:
    """Implement `solve_subproblems` for weights and needs that are floats."""
    total, states = 0.0, room_for_states(MAX_STATES)
    for j in range(len(need)):
        a, b = first[j], first[j + 1]
        cost = cheapest_by_states(weight[a:b], price[a:b], copies[a:b], need[j], 0.0, states, group[a:b], excess[a:b])
        if not np.isfinite(cost):
            return np.inf
        total += cost
    return total


@compiled
def solve_all(
    first: WholeArray,
    weight: WholeArray,
    copies: WholeArray,
    price: FloatArray,
    need: WholeArray,
    max_weight: WholeArray,
    group: WholeArray,
    excess: FloatArray,
) -> float:
    """Implement `solve_subproblems` for integers: fill `group` and, unless it is empty, `excess`."""
    total, compare = 0.0, len(excess) > 0
    for j in range(len(need)):
        a, b = first[j], first[j + 1]
        cost = solve_one(weight[a:b], price[a:b], copies[a:b], need[j], max_weight[j], group[a:b], excess[a:b], compare)
        if not np.isfinite(cost):
            return np.inf
        total += cost
    return total


@compiled
def solve_one(
    weight: WholeArray,
    price: FloatArray,
    copies: WholeArray,
    need: int,
    max_weight: int,
    group: WholeArray,
    excess: FloatArray,
    compare: bool,
) -> float:
    """Write the cheapest group of one task and return its cost, ``inf`` if there is none."""
    exact, pairs = max_weight >= 0, len(weight)
    if not compare and need > 0 and (exact or (pairs > 0 and price.min() >= 0)):
        most = max_weight if exact else need + weight.max() - 1  # in a minimal group
        paid, cheapest = cheapest_by_core(weight, price, copies, need, most)
        for p in range(pairs):
            group[p] = cheapest[p]
        return paid
    table = fill_table(weight, price, copies, max(need, max_weight), exact)
    cost, best = table[0], need
    for s in range(need, max_weight + 1):
        if cost[s] < cost[best]:
            best = s
    least: float = cost[best]
    if not np.isfinite(least):
        return np.inf
    cheapest = read_group(table, pairs, best)
    for p in range(pairs):
        group[p] = cheapest[p]
    for p in range(pairs if compare else 0):
        with_it = np.inf
        if exact:
            for s in range(max(need, weight[p]), max_weight + 1):
                with_it = min(with_it, cost[s - weight[p]])
        else:
            with_it = cost[max(0, need - weight[p])]
        excess[p] = with_it + price[p] - least
    return least
