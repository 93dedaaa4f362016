"""The configuration bound by a subgradient method, for where column generation takes too long.

The dual prices of the linear programme of single agents are a good start: each agent costs the value of its work on
its best task. From there prices follow a deflected subgradient: agents that the cheapest groups of all tasks use more
than once get dearer, unused ones cheaper. As soon as the groups together cost more than all agents, T is proven
impossible, and the next larger T comes.

References
----------
Camerini, Fratta and Maffioli (1975), On improving relaxation methods by modified gradient techniques,
doi:10.1007/BFb0120697.
"""

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.knapsack_core import cheapest_by_core
from alloc.allocators.exact.makespan.configuration import PRICE_SUM
from alloc.allocators.exact.model import Model
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

GRID = 4096
"""Steps into which the need of a task is divided: weights are rounded up to them."""

MAX_PAIRS = 200_000
"""Pairs of class and task above which there is no such bound."""

FIRST_LEVEL, LAST_LEVEL = 2e-3, 1e-5
"""How much above its best value the subgradient method wants theta, at first and at the end."""

PATIENCE = 12
"""Rounds without progress after which it wants half as much."""

DEFLECTION = 0.5
"""Part of the last direction that is added to the subgradient."""

LEAST_RISE = 1e-6
"""Rise of theta that counts as progress."""

LARGEST_RISE = 0.005
"""Largest relative rise of T at once."""


class ConfigurationAscent:
    """Prices of agents that rise to the bound.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low : float
        Proven bound in hours.
    price : ndarray, shape (t,)
        Value of a unit of each workload by the linear programme of single agents.

    Attributes
    ----------
    is_tractable : bool
        Whether its tables are of a size that can be computed.
    proven : float
        The largest T that has been proven impossible; 0 at first.
    """

    def __init__(self, model: Model, low: float, price: FloatArray) -> None:
        self._model, self._time, self.proven = model, low, 0.0
        self._count = model.classes.count.astype(np.int64)
        self.is_tractable = len(model.class_of_pair) <= MAX_PAIRS
        value = (model.uncapped(low)[0] * price).max(axis=1)
        self._price = self._best_price = value / (value @ self._count)
        self._direction = np.zeros(len(value))
        self._best, self._stale, self._level = 0.0, 0, FIRST_LEVEL

    @property
    def converged(self) -> bool:
        """Whether prices hardly change any more."""
        return self._level < LAST_LEVEL

    def round(self, low: float) -> bool:
        """Solve the knapsacks at the current prices, and change these; return whether a T was proven impossible.

        Parameters
        ----------
        low : float
            No T below it matters.
        """
        if self._time < low:
            self._time, self._best = low, 0.0
        count, price = self._count, np.round(self._price * PRICE_SUM)
        used = np.zeros(len(count))
        weight, need = _in_steps(self._model, self._time)
        cost, total = cheapest_groups(weight, price, count, need, used), float(price @ count)
        theta = cost / total
        is_excluded = cost > total  # a comparison of whole numbers
        if is_excluded:
            self.proven = self._time
            self._time *= 1 + min(LARGEST_RISE, theta - 1)
        if is_excluded or theta > self._best + LEAST_RISE:
            self._best, self._best_price, self._stale = min(1.0, theta), self._price, 0
        else:
            self._stale += 1
        if self._stale > PATIENCE:
            self._price, self._direction = self._best_price, np.zeros(len(count))
            self._level, self._stale = self._level / 2, 0
        elif np.isfinite(theta):
            self._change_prices(used - count, self._best + self._level - min(1.0, theta))
        return is_excluded

    def _change_prices(self, subgradient: FloatArray, rise: float) -> None:
        """Step along the subgradient, deflected by the last direction, to where theta may have risen by `rise`."""
        self._direction = subgradient + DEFLECTION * self._direction
        norm = float(self._direction @ self._direction)
        price = np.maximum(0.0, self._price + rise / max(norm, 1.0) * self._direction)
        total = float(price @ self._count)
        self._price = price / total if total > 0 else self._best_price


def _in_steps(model: Model, time: float) -> tuple[WholeArray, WholeArray]:
    """Return weights, shape (t, k), and needs, shape (t,), such that what is impossible so is impossible indeed."""
    weight, need = model.uncapped(time)
    step = need / GRID
    whole = np.ceil(weight / step).T.astype(np.int64)
    return np.ascontiguousarray(np.minimum(whole, GRID)), np.full(len(need), GRID, dtype=np.int64)


@compiled
def cheapest_groups(
    weight: WholeArray, price: FloatArray, count: WholeArray, need: WholeArray, used: FloatArray
) -> float:
    """Return the cost of the cheapest groups of all tasks, and add their agents of each class to `used`.

    Parameters
    ----------
    weight : ndarray of int64, shape (t, k)
    price : ndarray, shape (k,)
        Whole numbers >= 0.
    count : ndarray of int64, shape (k,)
    need : ndarray of int64, shape (t,)
    used : ndarray, shape (k,)
    """
    total, classes = 0.0, len(price)
    some, these, cost = np.empty(classes, dtype=np.int64), np.empty(classes, dtype=np.int64), np.empty(classes)
    copies = np.empty(classes, dtype=np.int64)
    for j in range(len(need)):
        size, largest = 0, 1
        for k in range(classes):
            if weight[j, k] > 0:
                some[size], these[size], cost[size], copies[size] = k, weight[j, k], price[k], count[k]
                largest = max(largest, weight[j, k])
                size += 1
        most = need[j] + largest - 1  # without an agent that can be spared
        paid, group = cheapest_by_core(these[:size], cost[:size], copies[:size], need[j], most)
        total += paid
        for q in range(size):
            used[some[q]] += group[q]
    return total


def compile_loops() -> None:
    """Compile the loop, or read it from the cache, so that no run waits for it."""
    ones = np.ones(2, dtype=np.int64)
    cheapest_groups(np.ones((1, 2), dtype=np.int64), np.ones(2), ones, ones[:1], np.zeros(2))
