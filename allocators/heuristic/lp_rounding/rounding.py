"""Rounding of fractional allocations: integer parts are kept, and the remaining agents matched with slots of tasks."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from alloc.problems.instance import FloatArray, IntArray

CLOSE = 1e-7
"""Distance from an integer up to which a value counts as that integer."""


def round_fractions(
    agent_class: IntArray, task: IntArray, amount: FloatArray, share: FloatArray, cost: FloatArray, count: IntArray
) -> IntArray:
    """Round a fractional allocation so that no task loses more than one agent, at most that with the largest share.

    Integer parts are kept. The fractions on each task, largest share first, fill slots of one agent each; all slots
    except the last are full, so that there is a matching of slots with agents that costs no more than the fractions.

    Parameters
    ----------
    agent_class, task : ndarray of int, shape (p,)
        Class of agents and task of each pair.
    amount : ndarray, shape (p,)
        Number of agents of the class on the task, >= 0.
    share, cost : ndarray, shape (p,)
        Share of the task that one such agent completes, and its cost.
    count : ndarray of int, shape (k,)
        Number of agents in each class.

    Returns
    -------
    ndarray of int, shape (p,)
        Number of agents of the class on the task.

    References
    ----------
    Shmoys and Tardos (1993), doi:10.1007/BF01585178; Bezakova and Dani (2005), doi:10.1145/1120680.1120683, for
    covering.
    """
    integer = np.floor(amount + CLOSE).astype(np.intp)
    left = count - np.bincount(agent_class, weights=integer, minlength=len(count)).astype(np.intp)
    fraction = np.where(amount - integer > CLOSE, amount - integer, 0.0)
    pair, slot, part = _slots(task, fraction, share)
    copies = np.minimum(left, np.bincount(agent_class[pair], minlength=len(count)))
    agent = np.repeat(np.arange(len(count)), copies)
    if not len(pair) or not len(agent):
        return integer
    reward = 1.0 + 2 * len(pair) * float(np.abs(cost[pair]).max())  # exceeds all costs, as filling slots has priority
    full = np.bincount(slot, weights=part) > 1 - 2 * CLOSE  # all of these can be filled at once, and must be
    matrix = np.zeros((slot.max() + 1, len(count)))
    lookup = np.full(matrix.shape, -1, dtype=np.intp)
    matrix[slot, agent_class[pair]] = cost[pair] - reward * (1 + full[slot])
    lookup[slot, agent_class[pair]] = pair
    row, column = linear_sum_assignment(matrix[:, agent])
    chosen = lookup[row, agent[column]]
    np.add.at(integer, chosen[chosen >= 0], 1)
    return integer


def _slots(task: IntArray, fraction: FloatArray, share: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Fill the slots of each task with fractions, largest share first; return pairs, slots and amounts."""
    some = np.flatnonzero(fraction > 0)
    order = some[np.lexsort((-share[some], task[some]))]
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
