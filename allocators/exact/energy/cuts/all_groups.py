"""All groups of a task that a better plan may have, written out by a depth-first search; compiled."""

import numpy as np

from alloc.allocators.exact.energy.cuts.pricing import count_cuts, fine_of, list_items, tabulate_rest
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MAX_NODES = 200_000
"""Nodes of the search for the groups of one task after which they count as too many."""


@compiled
def write_groups(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: int, max_weight: int, first_cut: WholeArray,
    cut: WholeArray, penalty: FloatArray, limit: float, group: WholeArray,
) -> int:  # fmt: skip
    """Write the groups of one task that cost at most `limit`, penalties included, and return how many they are.

    Parameters
    ----------
    weight, price, copies, need, max_weight, first_cut, cut, penalty
        As in `pricing.price_groups`; weights are whole.
    group : ndarray of int, shape (g, p)
        Zeros; gets the agents of each group.

    Returns
    -------
    int
        More than there is room for in `group` where they are too many.
    """
    exact, taken = max_weight >= 0, np.zeros(len(penalty), dtype=np.int64)
    item, items = list_items(weight, price, copies, first_cut, True)[0], copies.sum()
    rest = tabulate_rest(weight, price, item, 1.0, need, max(need, max_weight), exact)
    top, found, nodes, q = rest.shape[1] - 1, 0, 0, 0
    done, branches = np.zeros(items + 1, dtype=np.int64), np.zeros(items + 1, dtype=np.int64)
    paid, take = np.zeros(items + 1), np.zeros(items + 1, dtype=np.bool_)
    while q >= 0:
        if branches[q] == 0:
            nodes += 1
            if nodes > MAX_NODES or found > len(group):
                return len(group) + 1
            is_open = paid[q] + rest[q, min(top, done[q])] <= limit
            if is_open and q == items:
                for z in range(items):
                    if found < len(group) and take[z]:
                        group[found, item[z]] += 1
                found += 1
            if not is_open or q == items:
                q -= 1
                continue
        elif take[q]:  # that branch has been searched
            count_cuts(item[q], -1, first_cut, cut, taken)
        if branches[q] == 2:
            q -= 1
            continue
        k = item[q]
        take[q], branches[q] = branches[q] == 0, branches[q] + 1
        done[q + 1], paid[q + 1], branches[q + 1] = done[q], paid[q], 0
        if take[q]:
            done[q + 1] += int(weight[k])
            if (exact and done[q + 1] > top) or (q > 0 and item[q - 1] == k and not take[q - 1]):
                take[q] = False  # of agents alike the first
                continue
            paid[q + 1] += price[k] + fine_of(k, first_cut, cut, penalty, taken)
            count_cuts(k, 1, first_cut, cut, taken)
        q += 1
    return found
