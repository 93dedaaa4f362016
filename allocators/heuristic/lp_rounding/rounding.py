"""Fractions of agents on tasks to whole ones: floors, then a matching of those left with slots of the tasks."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from alloc.problems.instance import FloatArray, IntArray

CLOSE = 1e-7
"""Distance from a whole number that counts as none, as solvers leave it."""


def round_fractions(
    kind: IntArray, task: IntArray, amount: FloatArray, worth: FloatArray, cost: FloatArray, count: IntArray
) -> IntArray:
    """Round a fractional plan so that no task loses more than one agent, the largest of its fractions.

    Whole parts stay. The fractions on each task, largest ability first, fill slots of one agent each; every slot but
    the last is full, so that a matching of slots with agents exists that costs no more than the fractions did.

    Parameters
    ----------
    kind, task : ndarray of int, shape (p,)
        Class of agents and task of each pair.
    amount : ndarray, shape (p,)
        Agents of the class on the task, >= 0.
    worth, cost : ndarray, shape (p,)
        What one such agent brings to the task, and costs.
    count : ndarray of int, shape (k,)
        Agents in each class.

    Returns
    -------
    ndarray of int, shape (p,)
        Whole agents of the class on the task.

    References
    ----------
    Shmoys and Tardos (1993), doi:10.1007/BF01585178; Bezakova and Dani (2005), doi:10.1145/1120680.1120683, for
    covering.
    """
    whole = np.floor(amount + CLOSE).astype(np.intp)
    left = count - np.bincount(kind, weights=whole, minlength=len(count)).astype(np.intp)
    fraction = np.where(amount - whole > CLOSE, amount - whole, 0.0)
    pair, slot, part = _slots(task, fraction, worth)
    copies = np.minimum(left, np.bincount(kind[pair], minlength=len(count)))
    agent = np.repeat(np.arange(len(count)), copies)
    if not len(pair) or not len(agent):
        return whole
    high = 1.0 + 2 * len(pair) * float(np.abs(cost[pair]).max())
    full = np.bincount(slot, weights=part) > 1 - 2 * CLOSE  # all of these can be filled at once, and must be
    price = np.zeros((slot.max() + 1, len(count)))
    lookup = np.full(price.shape, -1, dtype=np.intp)
    price[slot, kind[pair]] = cost[pair] - high * (1 + full[slot])
    lookup[slot, kind[pair]] = pair
    row, column = linear_sum_assignment(price[:, agent])
    chosen = lookup[row, agent[column]]
    np.add.at(whole, chosen[chosen >= 0], 1)
    return whole


def _slots(task: IntArray, fraction: FloatArray, worth: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Fill the slots of each task with fractions, most worth first; return pairs, slots, and how much is there."""
    some = np.flatnonzero(fraction > 0)
    order = some[np.lexsort((-worth[some], task[some]))]
    pairs: list[int] = []
    slots: list[int] = []
    parts: list[float] = []
    number, room, current = -1, 0.0, -1
    for index in order.tolist():
        if task[index] != current:
            current, number, room = int(task[index]), number + 1, 1.0
        amount = float(fraction[index])
        while amount > CLOSE:
            if room <= CLOSE:
                number, room = number + 1, 1.0
            pairs.append(index)
            slots.append(number)
            taken = min(room, amount)
            parts.append(taken)
            room, amount = room - taken, amount - taken
    return np.array(pairs, dtype=np.intp), np.array(slots, dtype=np.intp), np.array(parts)
