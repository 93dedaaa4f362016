"""The cheapest group of a task with penalties on sets of classes: a knapsack and a tree search, compiled.

A cut counts the agents that a group takes from a set of classes; every second one costs the cut's penalty. A dynamic
programme without penalties bounds the cost of the rest of a group, which guides a depth-first search over the agents,
those in cuts first. With integer weights, the table is exact for all other agents. Otherwise it is based on weights
rounded up, and the search continues to the last agent.
"""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.exact.knapsack import WholeArray, order_of
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

STEPS, MAX_STEPS, CELLS = 1000, 10_000, 200_000
"""Minimum and maximum number of steps of a need for non-integer weights, and the target number of table cells."""


@compiled
def price_groups(
    first: WholeArray, weight: FloatArray, price: FloatArray, copies: WholeArray, need: FloatArray,
    max_weight: WholeArray, whole: bool, first_cut: WholeArray, cut: WholeArray, penalty: FloatArray,
    cost: FloatArray, group: WholeArray, max_nodes: int,
) -> float:  # fmt: skip
    """Write the cheapest group of each task if it is cheaper than the known one; return a bound on their total cost.

    Parameters
    ----------
    first : ndarray of int, shape (t + 1,)
        Index of the first pair of each task.
    weight, price, copies : ndarray, shape (p,)
    need, max_weight : ndarray, shape (t,)
        Smallest and largest sum of weights; the latter is unlimited if negative.
    whole : bool
        Whether weights and needs are integers.
    first_cut, cut : ndarray of int, shapes (p + 1,) and (c,)
        The cuts of each pair: `cut` from each `first_cut` to the next.
    penalty : ndarray, shape (cuts,)
        >= 0.
    cost : ndarray, shape (t,)
        Input: the cost of the cheapest known group of each task; output: a lower bound on the cost of any group.
    group : ndarray of int, shape (p,)
        Output, initially zeros, unchanged for tasks without a cheaper group.
    max_nodes : int
        Nodes of the search for one group after which it ends with the bound of the nodes still open.
    """
    total, taken = 0.0, np.zeros(len(penalty), dtype=np.int64)
    for j in range(len(need)):
        a, b = first[j], first[j + 1]
        cost[j] = cheapest_with_cuts(
            weight[a:b], price[a:b], copies[a:b], need[j], max_weight[j], whole,
            first_cut[a : b + 1], cut, penalty, taken, cost[j], group[a:b], max_nodes,
        )  # fmt: skip
        total += cost[j]
    return total


@compiled
def cheapest_with_cuts(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, max_weight: int, whole: bool,
    first_cut: WholeArray, cut: WholeArray, penalty: FloatArray, taken: WholeArray, best: float, group: WholeArray,
    max_nodes: int,
) -> float:  # fmt: skip
    """Implement `price_groups` for one task; `taken` is scratch for agents in each cut, 0 before and after."""
    exact, slack = max_weight >= 0, 1e-9 * (abs(best) + (np.abs(price).max() if len(price) else 0.0))
    if not exact:
        copies = of_interest(weight, price, copies, need, best - slack)
    item, searched = list_items(weight, price, copies, first_cut, whole)
    steps = min(MAX_STEPS, max(STEPS, CELLS // (1 + len(item))))
    scale = 1.0 if whole else steps * (1 - 1e-9) / need
    least = int(np.floor(need * scale))
    rest = tabulate_rest(weight, price, item, scale, least, max(least, max_weight), exact)
    top, still_open, nodes, q = rest.shape[1] - 1, np.inf, 0, 0
    done, paid = np.zeros(searched + 1), np.zeros(searched + 1)
    branches, take = np.zeros(searched + 1, dtype=np.int64), np.zeros(searched + 1, dtype=np.bool_)
    while q >= 0:
        here = min(top, int(np.ceil(done[q] * scale)))
        if branches[q] == 0:
            lower, nodes = paid[q] + rest[q, here], nodes + 1
            is_open = lower < best - slack
            if is_open and nodes > max_nodes:
                still_open, is_open = min(still_open, lower), False
            if is_open and q == searched:
                is_open = False
                if whole or done[q] >= need:
                    best = lower
                    write_group(item, take[:searched], weight, rest, here, top, group)
            if not is_open:
                q -= 1
                continue
        elif take[q]:  # this branch has been searched
            count_cuts(item[q], -1, first_cut, cut, taken)
        if branches[q] == 2:
            q -= 1
            continue
        k, with_it = item[q], np.inf
        paid_with = paid[q] + price[k] + fine_of(k, first_cut, cut, penalty, taken)
        after = int(np.ceil((done[q] + weight[k]) * scale))
        if (after <= top or not exact) and (q == 0 or item[q - 1] != k or take[q - 1]):  # symmetry
            with_it = paid_with + rest[q + 1, min(after, top)]
        take[q] = (with_it < paid[q] + rest[q + 1, here]) == (branches[q] == 0)
        branches[q] += 1
        if take[q] and not np.isfinite(with_it):
            take[q] = False
            continue
        done[q + 1], paid[q + 1], branches[q + 1] = done[q], paid[q], 0
        if take[q]:
            done[q + 1], paid[q + 1] = done[q] + weight[k], paid_with
            count_cuts(k, 1, first_cut, cut, taken)
        q += 1
    return min(best - slack, still_open)


@compiled
def of_interest(weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, best: float) -> WholeArray:
    """Return `copies`, with zeros for classes that no group cheaper than `best` uses.

    This follows from the linear relaxation without penalties, for prices >= 0 and unlimited sums of weights.
    """
    ratio, total, relaxed, rate = price / weight, 0.0, 0.0, 0.0
    if len(price) == 0 or price.min() < 0:
        return copies
    for k in order_of(ratio):
        rate = ratio[k]
        taken = min(copies[k] * weight[k], need - total)
        total, relaxed = total + taken, relaxed + taken * rate
        if total >= need:
            break
    kept = copies.copy()
    for k in range(len(kept)):
        if relaxed + price[k] - rate * weight[k] >= best:
            kept[k] = 0
    return kept


@compiled
def list_items(
    weight: FloatArray, price: FloatArray, copies: WholeArray, first_cut: WholeArray, whole: bool
) -> tuple[WholeArray, int]:
    """Return the class of each agent, those in cuts first, and the number of agents on which the search branches."""
    item, items, searched = np.empty(copies.sum(), dtype=np.int64), 0, 0
    order = order_of(price / weight)
    for in_cuts in (True, False):
        for k in order:
            if (first_cut[k + 1] > first_cut[k]) == in_cuts:
                item[items : items + copies[k]] = k
                items += copies[k]
        if in_cuts or not whole:
            searched = items
    return item, searched


@compiled
def tabulate_rest(
    weight: FloatArray, price: FloatArray, item: WholeArray, scale: float, need: int, top: int, exact: bool
) -> FloatArray:
    """Return the least cost of agents q, q + 1, ... if those before weigh s, shape (agents + 1, top + 1)."""
    rest = np.full((len(item) + 1, top + 1), np.inf)
    rest[len(item), need:] = 0.0
    for q in range(len(item) - 1, -1, -1):
        paid, row, after = price[item[q]], rest[q], rest[q + 1]
        w = int(np.ceil(weight[item[q]] * scale))
        inside = max(0, top + 1 - w)
        for s in range(inside):
            row[s] = min(after[s], after[s + w] + paid)
        beyond = np.inf if exact else after[top] + paid
        for s in range(inside, top + 1):
            row[s] = min(after[s], beyond)
    return rest


@compiled
def write_group(
    item: WholeArray, take: NDArray[np.bool_], weight: FloatArray, rest: FloatArray, done: int, top: int,
    group: WholeArray,
) -> None:  # fmt: skip
    """Write the agents that the search has taken, and the cheapest choice of the others by the table."""
    group[:] = 0
    for q in range(len(item)):
        if q < len(take):
            group[item[q]] += take[q]
        elif rest[q + 1, done] > rest[q, done]:
            group[item[q]] += 1
            done = min(top, done + int(weight[item[q]]))


@compiled
def count_cuts(k: int, change: int, first_cut: WholeArray, cut: WholeArray, taken: WholeArray) -> None:
    """Add `change` to the number of agents in the cuts of class `k`."""
    for z in range(first_cut[k], first_cut[k + 1]):
        taken[cut[z]] += change


@compiled
def fine_of(k: int, first_cut: WholeArray, cut: WholeArray, penalty: FloatArray, taken: WholeArray) -> float:
    """Return the penalties of one more agent of class `k`."""
    fine = 0.0
    for z in range(first_cut[k], first_cut[k + 1]):
        if taken[cut[z]] % 2 == 1:
            fine += penalty[cut[z]]
    return fine
