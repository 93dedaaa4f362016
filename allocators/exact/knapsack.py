"""The cheapest group for a task at given prices: a knapsack problem by dynamic programming, compiled.

A group takes some of the agents of each class, at most `copies` of them; each adds `weight` (a whole number) and costs
`price`. Its weights must sum to a need or more, or if `exact` to the need itself. One table answers for every need up
to `most`, so that tasks at the same prices share it:

    table = fill_table(weight, price, copies, most, False)
    costs = table[0]                                 # of needs 0, 1, ..., most; inf if infeasible
    group = read_group(table, len(weight), need)     # agents of each class in the cheapest group for `need`

Time and memory are O(items * most). For each weight only the cheapest agents become items, and identical ones are
packed by powers of two, so that there are O(most * log(most)) items, whatever the number of agents.

References
----------
Kellerer, Pferschy and Pisinger (2004), Knapsack Problems, section 7.1, doi:10.1007/978-3-540-24777-7.
"""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

WholeArray = NDArray[np.int64]

Table = tuple[FloatArray, WholeArray, WholeArray, WholeArray, NDArray[np.uint8]]
"""Costs, shape (most + 1,); class, agents and weight of each item, shape (i,); items taken, shape (i, most + 1)."""


@compiled
def order_of(value: FloatArray) -> WholeArray:
    """Return the indices that sort `value`, by Shell sort, as numpy's sort takes over a second to compile."""
    order = np.empty(len(value), dtype=np.int64)
    for k in range(len(value)):
        order[k] = k
    gap = len(value) // 2
    while gap > 0:
        for q in range(gap, len(value)):
            k, place = order[q], q
            while place >= gap and value[order[place - gap]] > value[k]:
                order[place] = order[place - gap]
                place -= gap
            order[place] = k
        gap = 1 if gap == 2 else gap * 5 // 11
    return order


@compiled
def pack_items(
    weight: WholeArray, price: FloatArray, copies: WholeArray, most: int, exact: bool
) -> tuple[WholeArray, WholeArray]:
    """Return class and number of agents of each item, shape (i,), enough for a cheapest group.

    All agents with a negative price become items, unless the sum must be met exactly.
    """
    left = np.zeros(most + 1, dtype=np.int64)  # number of further agents of each weight that are of use
    for w in range(1, most + 1):
        left[w] = most // w if exact else (most + w - 1) // w
    bits = 2
    for k in range(len(weight)):
        rest = copies[k]
        while rest > 0:
            rest //= 2
            bits += 1
    item_class, size, items = np.empty(bits, dtype=np.int64), np.empty(bits, dtype=np.int64), 0
    order = order_of(price)
    for q in range(len(order)):
        k = order[q]
        w = weight[k]
        if w < 1 or (exact and w > most):
            continue
        w = min(w, most)
        rest = copies[k] if price[k] < 0 and not exact else min(copies[k], left[w])
        left[w] = max(0, left[w] - rest)
        pack = 1
        while rest > 0:
            item_class[items], size[items] = k, min(pack, rest)
            rest -= size[items]
            pack *= 2
            items += 1
    return item_class[:items], size[:items]


@compiled
def fill_table(weight: WholeArray, price: FloatArray, copies: WholeArray, most: int, exact: bool) -> Table:
    """Return the least cost of every need up to `most`, with the tables for `read_group`.

    Parameters
    ----------
    weight : ndarray of int64, shape (k,)
        Contribution of one agent of each class; classes with weight 0 are ignored.
    price : ndarray of float64, shape (k,)
        Cost of one agent of each class; may be negative, but not nan.
    copies : ndarray of int64, shape (k,)
        Number of agents in each class.
    most : int
        The largest need, >= 0.
    exact : bool
        Whether needs must be met exactly, without surplus.

    Returns
    -------
    Table
        Its first entry, shape (most + 1,), is the least cost of each need, ``inf`` if infeasible.
    """
    item_class, size = pack_items(weight, price, copies, most, exact)
    added = np.empty(len(item_class), dtype=np.int64)
    taken = np.empty((len(item_class), most + 1), dtype=np.uint8)
    cost, after = np.full(most + 1, np.inf), np.empty(most + 1)
    cost[0] = 0.0
    for i in range(len(item_class)):
        added[i] = min(most, weight[item_class[i]] * size[i]) if not exact else weight[item_class[i]] * size[i]
        whole, paid, row = min(added[i], most + 1), price[item_class[i]] * size[i], taken[i]
        first = np.inf if exact else cost[0] + paid  # this item alone meets the smallest needs
        for need in range(whole):
            better = first < cost[need]
            after[need] = first if better else cost[need]
            row[need] = better
        for need in range(whole, most + 1):
            candidate = cost[need - whole] + paid
            better = candidate < cost[need]
            after[need] = candidate if better else cost[need]
            row[need] = better
        cost, after = after, cost
    return cost, item_class, size, added, taken


@compiled
def read_group(table: Table, classes: int, need: int) -> WholeArray:
    """Return the agents of each class in the cheapest group for `need`, whose cost is finite, shape (classes,)."""
    _, item_class, size, added, taken = table
    group = np.zeros(classes, dtype=np.int64)
    for i in range(len(item_class) - 1, -1, -1):
        if taken[i, need]:
            group[item_class[i]] += size[i]
            need = max(0, need - added[i])
    return group


@compiled
def cheapest_group(
    weight: WholeArray, price: FloatArray, copies: WholeArray, need: int, max_weight: int
) -> tuple[float, WholeArray]:
    """Return cost and agents of each class of the cheapest group with a sum of weights from `need` to `max_weight`.

    Parameters
    ----------
    weight, price, copies
        As in `fill_table`.
    need : int
        Least sum of weights, >= 0.
    max_weight : int
        Largest sum of weights; unlimited if negative.

    Returns
    -------
    float
        ``inf`` if there is no such group.
    ndarray of int64, shape (k,)
    """
    table = fill_table(weight, price, copies, max(need, max_weight), max_weight >= 0)
    cost, best = table[0], need
    for total in range(need, max_weight + 1):
        if cost[total] < cost[best]:
            best = total
    if not np.isfinite(cost[best]):
        return np.inf, np.zeros(len(weight), dtype=np.int64)
    return cost[best], read_group(table, len(weight), best)
