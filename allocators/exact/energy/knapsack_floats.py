"""The cheapest group for a task where weights are no integers: states around the linear relaxation; compiled.

At the price of weight at which the linear relaxation breaks, each agent has a reduced cost; by its sign the agent is
taken or left. A state takes or leaves some agents the other way, which adds the absolute values of their reduced costs
to the relaxation, and so does, at that price, weight beyond the need. Agents are considered in the order of these
values: a state is dropped when it and the next value exceed the best group, or if another is no lighter and no dearer.

References
----------
Balas and Zemel (1980), An algorithm for large zero-one knapsack problems, doi:10.1287/opre.28.5.1130. Pisinger (1997),
A minimal algorithm for the 0-1 knapsack problem, doi:10.1287/opre.45.5.758.
"""

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray, order_of
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MAX_STATES = 50_000
"""States of one knapsack, after which what is proven so far is returned."""


@compiled
def cheapest_in_floats(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, group: WholeArray, excess: FloatArray
) -> float:
    """Return a lower bound on the cost of a group with a sum of weights of at least `need`, nearly always the least.

    Parameters
    ----------
    weight : ndarray, shape (k,)
        What one agent of each class adds, > 0.
    price : ndarray, shape (k,)
        What one costs, >= 0.
    copies : ndarray of int64, shape (k,)
        Agents in each class.
    need : float
        > 0.
    group : ndarray of int64, shape (k,)
        Overwritten by the agents of each class in the best group found.
    excess : ndarray, shape (k,) or (0,)
        Overwritten by lower bounds on how much dearer the best group with an agent of the class is.

    Returns
    -------
    float
        ``inf`` if there is no such group.
    """
    classes = len(weight)
    reduced, change = np.empty(classes), np.empty(classes)
    rate, total = break_price(weight, price, copies, need, reduced)
    if total < need:
        return np.inf
    relaxed, base = rate * need, 0.0
    for k in range(classes):
        reduced[k] = price[k] - rate * weight[k]
        change[k], group[k] = abs(reduced[k]), 0
        if reduced[k] < 0:
            group[k] = copies[k]
            relaxed += reduced[k] * copies[k]
            base += weight[k] * copies[k]
    beyond = best_states(weight, reduced, change, copies, base, rate, need, group)
    for k in range(len(excess)):
        excess[k] = max(reduced[k], 0.0) - beyond
    return relaxed + beyond


@compiled
def break_price(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, ratio: FloatArray
) -> tuple[float, float]:
    """Return the price of weight at which the linear relaxation breaks, and the weight of all agents up to there."""
    rate, total = 0.0, 0.0
    for k in range(len(weight)):
        ratio[k] = price[k] / weight[k]
    for k in order_of(ratio):
        rate = ratio[k]
        total += weight[k] * copies[k]
        if total >= need:
            break
    return rate, total


@compiled
def best_states(
    weight: FloatArray,
    reduced: FloatArray,
    change: FloatArray,
    copies: WholeArray,
    base: float,
    rate: float,
    need: float,
    group: WholeArray,
) -> float:
    """Return a lower bound on what the best group costs beyond the relaxation; change `group` to the best one found.

    States are kept from heavy to light, hence from dear to cheap.
    """
    order = order_of(change)
    heavy, paid = np.empty(MAX_STATES + 1), np.empty(MAX_STATES + 1)  # weight, and sum of changes
    before, by = np.empty(MAX_STATES + 1, dtype=np.int64), np.empty(MAX_STATES + 1, dtype=np.int64)
    kept, merged = np.empty(MAX_STATES + 1, dtype=np.int64), np.empty(MAX_STATES + 1, dtype=np.int64)
    heavy[0], paid[0], before[0], kept[0] = base, 0.0, -1, 0
    states, size, best, best_state, open_from = 1, 1, np.inf, -1, np.inf
    if base >= need:
        best, best_state = rate * (base - need), 0
    for k in order:
        if change[k] >= best or open_from < np.inf:
            break
        sign = -1.0 if reduced[k] < 0 else 1.0
        for _ in range(copies[k]):
            if states + size > MAX_STATES:
                open_from = change[k]
                break
            fresh = states
            for q in range(size):
                state = kept[q]
                more = paid[state] + change[k]
                if more >= best:
                    continue
                heavy[states], paid[states] = heavy[state] + sign * weight[k], more
                before[states], by[states] = state, k
                value = more + rate * (heavy[states] - need)
                if heavy[states] >= need and value < best:
                    best, best_state = value, states
                states += 1
            size = merge_states(heavy, paid, kept, merged, size, fresh, states, rate, best - change[k])
            kept, merged = merged, kept
    state = best_state
    while state > 0:
        group[by[state]] += -1 if reduced[by[state]] < 0 else 1
        state = before[state]
    return min(best, open_from)


@compiled
def merge_states(
    heavy: FloatArray,
    paid: FloatArray,
    kept: WholeArray,
    merged: WholeArray,
    size: int,
    fresh: int,
    states: int,
    rate: float,
    most: float,
) -> int:
    """Write the states of `kept`, and those from `fresh` on, to `merged`, from heavy to light, and return how many.

    Left out are those whose changes exceed `most`, and those dominated.
    """
    q, count, cheapest = 0, 0, np.inf
    while q < size or fresh < states:
        if fresh == states or (q < size and heavy[kept[q]] >= heavy[fresh]):
            state = kept[q]
            q += 1
        else:
            state = fresh
            fresh += 1
        cost = paid[state] + rate * heavy[state]
        if paid[state] < most and cost < cheapest:
            merged[count], cheapest = state, cost
            count += 1
    return count
