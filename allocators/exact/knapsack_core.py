"""The cheapest group for a task with a limit on the sum of weights, by a knapsack over a core of classes; compiled.

At the optimal dual price of weight in the linear relaxation, each agent has a reduced cost. Only the core, the classes
with small reduced costs, is optimised; the other classes are taken or left by its sign. The core is enlarged until the
gap between its best group and the relaxation is less than the reduced cost of any class outside.

References
----------
Balas and Zemel (1980), An algorithm for large zero-one knapsack problems, doi:10.1287/opre.28.5.1130.
"""

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray, cheapest_group, order_of
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

FIRST_CORE = 24
"""Initial number of classes in the core."""


@compiled
def cheapest_by_core(
    weight: WholeArray, price: FloatArray, copies: WholeArray, need: int, max_weight: int
) -> tuple[float, WholeArray]:
    """Return the same as `knapsack.cheapest_group`, faster for many classes; `max_weight` >= `need`."""
    classes = len(weight)
    reduced, change = np.empty(classes), np.empty(classes)
    core_weight, core_price = np.empty(classes, dtype=np.int64), np.empty(classes)
    core_copies, full = np.empty(classes, dtype=np.int64), np.zeros(classes, dtype=np.int64)
    relaxed = solve_relaxation(weight, price, copies, need, max_weight, reduced, full)
    for k in range(classes):
        change[k] = abs(reduced[k])
    order = order_of(change)
    size = min(FIRST_CORE, classes)
    while True:
        fixed, movable, paid = 0, 0, 0.0
        for q in range(size):
            movable += weight[order[q]] * copies[order[q]]
        for q in range(size, classes):
            fixed += weight[order[q]] * full[order[q]]
            paid += price[order[q]] * full[order[q]]
        least, most = max(0, need - fixed), min(max_weight - fixed, movable)
        if least <= most:
            for q in range(size):
                k = order[q]
                core_weight[q], core_price[q], core_copies[q] = weight[k], price[k], copies[k]
            cost, group = cheapest_group(core_weight[:size], core_price[:size], core_copies[:size], least, most)
            gap = paid + cost - relaxed
            if size == classes or gap <= change[order[size]]:
                if not np.isfinite(cost):
                    break
                for q in range(size):
                    full[order[q]] = group[q]
                return paid + cost, full
        elif size == classes:
            break
        size = min(2 * size, classes)
    return np.inf, np.zeros(classes, dtype=np.int64)


@compiled
def solve_relaxation(
    weight: WholeArray,
    price: FloatArray,
    copies: WholeArray,
    need: int,
    max_weight: int,
    reduced: FloatArray,
    full: WholeArray,
) -> float:
    """Return the value of the linear relaxation; write the reduced cost of each class and its integral part."""
    classes, total, rate = len(weight), 0, 0.0
    for k in range(classes):
        reduced[k] = price[k] / weight[k]
    order = order_of(reduced)
    for q in range(classes):
        rate = reduced[order[q]]
        total += weight[order[q]] * copies[order[q]]
        if total >= need:
            break
    relaxed = rate * (need if rate >= 0 else max_weight)
    for k in range(classes):
        reduced[k] = price[k] - rate * weight[k]
        if reduced[k] < 0:
            relaxed += reduced[k] * copies[k]
            full[k] = copies[k]
    return relaxed
