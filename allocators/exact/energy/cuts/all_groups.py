"""Enumeration of all groups of a task that a better plan may use, by depth-first search; compiled."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from alloc.allocators.exact.energy.cuts.pricing import STEPS, count_cuts, fine_of, list_items, tabulate_rest
from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

MAX_NODES = 200_000
"""Limit on the nodes of the search for the groups of one task; beyond it, there are too many groups."""

ROUNDED_UP = 1 + 1e-12
"""Factor on a need that sums of weights exceed regardless of rounding in the order of summation."""

Cuts = tuple[WholeArray, WholeArray, FloatArray]
"""The cuts of each pair, and their penalties: ``first_cut``, ``cut`` and ``penalty`` of `write_groups`."""


def groups_within(
    model: EnergyModel, paid: FloatArray, limit: FloatArray, cuts: Cuts, most: int, should_stop: Callable[[], bool]
) -> tuple[WholeArray, csr_array] | None:
    """Return all groups of each task that cost at most `limit`; None if more than `most`, or if stopped.

    Parameters
    ----------
    model : EnergyModel
    paid : ndarray, shape (p,)
        Cost of an agent of each pair.
    limit : ndarray, shape (t,)
        Largest cost of a group of each task.
    cuts : tuple of ndarray
    most : int
    should_stop : callable
        Called between tasks, as all together may take a second.

    Returns
    -------
    ndarray of int, shape (g,)
        Task of each group.
    csr_array of int, shape (g, p)
        Agents of each pair in each group.
    """
    first, weight, (first_cut, cut, penalty) = model.first, model.weight.astype(np.float64), cuts
    task, group = [np.zeros(0, dtype=np.int64)], [csr_array((0, len(paid)), dtype=np.int64)]
    for j in range(len(limit)):
        if should_stop():
            return None
        a, b, room = first[j], first[j + 1], most - sum(len(tasks) for tasks in task)
        inside = np.zeros((room, b - a), dtype=np.int64)
        found = write_groups(
            weight[a:b], paid[a:b], model.copies[a:b], float(model.need[j]), model.max_weight[j], model.is_whole,
            first_cut[a : b + 1], cut, penalty, limit[j], inside,
        )  # fmt: skip
        if found > room:
            return None
        rows, pairs = np.nonzero(inside[:found])
        entries = (inside[rows, pairs], (rows, a + pairs))
        task.append(np.full(found, j))
        group.append(csr_array(entries, shape=(found, len(paid))))
    return np.concatenate(task), csr_array(vstack(group))


@compiled
def write_groups(
    weight: FloatArray, price: FloatArray, copies: WholeArray, need: float, max_weight: int, whole: bool,
    first_cut: WholeArray, cut: WholeArray, penalty: FloatArray, limit: float, group: WholeArray,
) -> int:  # fmt: skip
    """Write the groups of one task that cost at most `limit`, penalties included, and return their number.

    If sums of weights are unlimited, only minimal groups are written.

    Parameters
    ----------
    weight, price, copies, need, max_weight, whole, first_cut, cut, penalty
        As in `pricing.price_groups`.
    group : ndarray of int, shape (g, p)
        Output, initially zeros: the agents of each group.

    Returns
    -------
    int
        A number larger than the capacity of `group` if there are too many.
    """
    exact, taken = max_weight >= 0, np.zeros(len(penalty), dtype=np.int64)
    item, items = list_items(weight, price, copies, first_cut, True)[0], copies.sum()
    scale = 1.0 if whole else STEPS * (1 - 1e-9) / need
    least = int(np.floor(need * scale))
    rest = tabulate_rest(weight, price, item, scale, least, max(least, max_weight), exact)
    top, found, nodes, q = rest.shape[1] - 1, 0, 0, 0
    done, branches = np.zeros(items + 1), np.zeros(items + 1, dtype=np.int64)
    paid, take = np.zeros(items + 1), np.zeros(items + 1, dtype=np.bool_)
    while q >= 0:
        if branches[q] == 0:
            nodes += 1
            if nodes > MAX_NODES or found > len(group):
                return len(group) + 1
            is_open = paid[q] + rest[q, min(top, int(np.ceil(done[q] * scale)))] <= limit
            if is_open and q == items and (exact or is_minimal(done[q], need, weight, item, take)):
                for z in range(items):
                    if found < len(group) and take[z]:
                        group[found, item[z]] += 1
                found += 1
            if not is_open or q == items:
                q -= 1
                continue
        elif take[q]:  # this branch has been searched
            count_cuts(item[q], -1, first_cut, cut, taken)
        if branches[q] == 2:
            q -= 1
            continue
        k = item[q]
        take[q], branches[q] = branches[q] == 0, branches[q] + 1
        done[q + 1], paid[q + 1], branches[q + 1] = done[q], paid[q], 0
        if take[q]:
            done[q + 1] += weight[k]
            is_alike = q > 0 and item[q - 1] == k and not take[q - 1]  # symmetry: identical agents are taken in order
            if is_alike or (done[q + 1] > top if exact else done[q] >= need):
                take[q] = False
                continue
            paid[q + 1] += price[k] + fine_of(k, first_cut, cut, penalty, taken)
            count_cuts(k, 1, first_cut, cut, taken)
        q += 1
    return found


@compiled
def is_minimal(done: float, need: float, weight: FloatArray, item: WholeArray, take: NDArray[np.bool_]) -> bool:
    """Whether the agents taken meet the need, and none of them can be left out."""
    least = np.inf
    for z in range(len(item)):
        if take[z]:
            least = min(least, weight[item[z]])
    return need <= done < need * ROUNDED_UP + least
