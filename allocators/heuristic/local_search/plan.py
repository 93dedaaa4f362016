"""The state of a search: who is in which group, and what each group brings."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import Small
from alloc.problems.instance import FloatArray

MOST_FREE = 32
"""Agents of two groups that are shared out anew at once, where sums of abilities are whole numbers."""

MOST_TRIED = 12
"""The same where every set of them is tried."""

MOST_HALVED = 16
"""The same where there are more, travel takes no time, and only sets that are just enough are tried; halves and space
must fit."""

TABLE_SIZE = 4096
"""Random numbers that are drawn beforehand."""

MOST_SUMS = 1 << 14
"""Sums of abilities that are told apart."""

SHORTS, CHANGED, CROWDED = 0, 1, 2
FLOWN, BEST = 0, 1


class Plan(NamedTuple):
    """One allocation, changed in place by the compiled loops; the idle ones are group m.

    Attributes
    ----------
    task : ndarray of int, shape (n,)
        Group of each agent.
    slot : ndarray of int
        Members of all groups, with room to grow.
    begin : ndarray of int, shape (m + 2,)
        Where the room of each group begins in `slot`.
    size : ndarray of int, shape (m + 1,)
        Members of each group.
    at : ndarray of int, shape (n,)
        Place of each agent in its group.
    need, load : ndarray, shape (m + 1,)
        Ability that each task needs, and has, to be done in time.
    short, short_at : ndarray of int, shape (m,)
        Tasks that lack something, and the place of each on that list, -1 for none.
    best, journal : ndarray of int, shape (n,)
        The best assignment so far, and the agents that moved since.
    counter : ndarray of int, shape (3,)
        Tasks short; moves since the best; whether a group was full.
    figure : ndarray, shape (2,)
        Distance flown, now and in the best.
    random : ndarray of uint64, shape (1,)
    """

    task: Small
    slot: Small
    begin: NDArray[np.int64]
    size: Small
    at: Small
    need: FloatArray
    load: FloatArray
    short: Small
    short_at: Small
    best: Small
    journal: Small
    counter: NDArray[np.int64]
    figure: FloatArray
    random: NDArray[np.uint64]


class Scratch(NamedTuple):
    """Room for one exchange, and random numbers of a logistic distribution."""

    agent: Small
    here: FloatArray
    there: FloatArray
    flight: FloatArray
    price: FloatArray
    cost: FloatArray
    sets: NDArray[np.uint64]
    trial_here: FloatArray
    trial_there: FloatArray
    trial_cost: FloatArray
    trial_set: NDArray[np.int64]
    logistic: FloatArray


class Weights(NamedTuple):
    """What counts in one exchange.

    Attributes
    ----------
    distance, noise : float
        Factors of distances and of random prices.
    charge, lack : float
        Penalty of a task that lacks something, and of each unit that it lacks.
    spare : float
        Surplus beyond what is needed that is looked at, in units of ability.
    sums : float
        The largest ability where sums of abilities are whole numbers and few, else infinite.
    """

    distance: float
    noise: float
    charge: float
    lack: float
    spare: float
    sums: float


def lay_out(task: Small, groups: int, least: NDArray[np.int64]) -> tuple[Small, NDArray[np.int64], Small, Small]:
    """Return `slot`, `begin`, `size` and `at` of an assignment, with room for `least` members in each group."""
    size = np.bincount(task, minlength=groups)
    room = np.maximum(least, 2 * size)
    room[-1] = len(task)
    begin = np.concatenate([[0], np.cumsum(room)])
    order = np.argsort(task, kind="stable")
    at = np.empty(len(task), dtype=np.int32)
    at[order] = np.arange(len(task)) - np.repeat(np.cumsum(size) - size, size)
    slot = np.full(begin[-1], -1, dtype=np.int32)
    slot[begin[task] + at] = np.arange(len(task))
    return slot, begin, size.astype(np.int32), at


def room_to_work(seed: int) -> Scratch:
    """Return room for exchanges, with random numbers from `seed`."""
    uniform = np.random.default_rng(seed).uniform(1e-9, 1 - 1e-9, TABLE_SIZE)
    cost, sets = np.empty(2 * MOST_SUMS), np.empty(2 * MOST_SUMS, dtype=np.uint64)
    here, there, flight, price = (np.empty(2 * MOST_FREE) for _ in range(4))
    trial_here, trial_there, trial_cost = (np.empty(1 << MOST_TRIED) for _ in range(3))
    trial_set = np.empty(1 << MOST_TRIED, dtype=np.int64)
    agent, logistic = np.empty(2 * MOST_FREE, dtype=np.int32), np.log(uniform / (1 - uniform))
    return Scratch(
        agent, here, there, flight, price, cost, sets, trial_here, trial_there, trial_cost, trial_set, logistic
    )
