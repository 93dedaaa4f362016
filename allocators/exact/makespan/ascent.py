"""The configuration bound by a subgradient method, for instances where column generation takes too long.

Initially, each agent costs the value of its work on its best task. Prices then follow a deflected subgradient: agents
that the cheapest groups of all tasks use more than once become dearer, unused ones cheaper. As soon as the groups
together cost more than all agents, T is proven infeasible and increased. Once prices have converged at a T that is not
excluded, the method restarts halfway to that T, with more patience.

References
----------
Camerini, Fratta and Maffioli (1975), On improving relaxation methods by modified gradient techniques,
doi:10.1007/BFb0120697.
"""

import numpy as np

from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.knapsack_states import CHEAPER, MAX_STATES, cheapest_by_states, room_for_states
from alloc.allocators.exact.makespan.configuration import PRICE_SUM
from alloc.allocators.exact.model import Model
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

GRID = 2**40
"""Number of steps into which the need of a task is divided; weights are rounded up to them."""

MAX_PAIRS = 1_000_000
"""Number of pairs of class and task above which the bound is not computed."""

FIRST_LEVEL, NEXT_LEVEL, LAST_LEVEL = 1e-2, 5e-4, 1e-5
"""Target increase of theta above its best value: initially, after a restart, and at the end."""

PATIENCE, MAX_PATIENCE = 12, 100
"""Rounds without progress after which that target is halved; doubled at each restart, up to the maximum."""

DEFLECTION = 0.5
"""Share of the last direction that is added to the subgradient."""

MIN_RISE = 1e-6
"""Smallest increase of theta that counts as progress."""

SMALL_RISE, LARGEST_RISE = 0.005, 0.1
"""Caps on the relative increase of T: the larger of theta - 1 up to the first, and a quarter of it up to the second, as
theta falls faster than T rises if travel takes long."""


class ConfigurationAscent:
    """Subgradient ascent on the prices of agents, for lower bounds on the makespan.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low : float
        Proven lower bound in hours.
    price : ndarray, shape (t,), optional
        Initial value of a unit of each workload; all equal by default.

    Attributes
    ----------
    is_tractable : bool
        Whether its tables are small enough.
    proven : float
        The largest T proven infeasible so far, initially 0.
    task_price : ndarray, shape (t,)
        Cost of each task's cheapest group per unit of its workload, at the best prices so far.
    """

    def __init__(self, model: Model, low: float, price: FloatArray | None = None) -> None:
        self._model, self._time, self.proven = model, low, 0.0
        self._count = model.classes.count.astype(np.int64)
        self.is_tractable = len(model.class_of_pair) <= MAX_PAIRS
        self.task_price = np.ones(len(model.tasks)) if price is None else price
        self._best, self._stale, self._level, self._patience = 0.0, 0, FIRST_LEVEL, PATIENCE
        if self.is_tractable:
            value = (model.uncapped(low)[0] * self.task_price).max(axis=1)
            self._price = self._best_price = value / max(1e-300, value @ self._count)
            self._direction = np.zeros(len(value))

    @property
    def converged(self) -> bool:
        """Whether prices hardly change any more."""
        return self._patience > MAX_PATIENCE

    def round(self, low: float) -> bool:
        """Solve the knapsacks at the current prices and update these; return whether a T was proven infeasible.

        Parameters
        ----------
        low : float
            Proven lower bound; smaller T are of no interest.
        """
        if self._time < low:
            self._time, self._best = low, 0.0
        count, price = self._count, np.round(self._price * PRICE_SUM)
        used = np.zeros(len(count))
        weight, need = _in_steps(self._model, self._time)
        costs = cheapest_groups(weight, price, count, need, used)
        cost, total = float(costs.sum()), float(price @ count)
        theta = cost / total
        is_excluded = cost > total  # exact: a comparison of integers
        if is_excluded:
            self.proven = self._time
            self._time *= 1 + max(min(SMALL_RISE, theta - 1), min(LARGEST_RISE, (theta - 1) / 4))
        if is_excluded or theta > self._best + MIN_RISE:
            self._best, self._best_price, self._stale = min(1.0, theta), self._price, 0
            if np.isfinite(theta):
                self.task_price = costs / self._model.workload
        else:
            self._stale += 1
        if self._stale > self._patience:
            self._restart()
        elif np.isfinite(theta):
            self._change_prices(used - count, self._best + self._level - min(1.0, theta))
        return is_excluded

    def _restart(self) -> None:
        """Return to the best prices, with a smaller target, or finally with a smaller T and more patience."""
        self._price, self._direction = self._best_price, np.zeros(len(self._count))
        self._level, self._stale = self._level / 2, 0
        if self._level < LAST_LEVEL:
            self._level, self._patience = NEXT_LEVEL, 2 * self._patience
            self._time, self._best = (max(self.proven, self._time / 2) + self._time) / 2, 0.0

    def _change_prices(self, subgradient: FloatArray, rise: float) -> None:
        """Step along the deflected subgradient, with a step size aimed at an increase of theta by `rise`."""
        self._direction = subgradient + DEFLECTION * self._direction
        norm = float(self._direction @ self._direction)
        price = np.maximum(0.0, self._price + rise / max(norm, 1.0) * self._direction)
        total = float(price @ self._count)
        self._price = price / total if total > 0 else self._best_price


def _in_steps(model: Model, time: float) -> tuple[FloatArray, FloatArray]:
    """Return rounded weights, shape (t, k), and needs, shape (t,), whose infeasibility implies that of T.

    They are integers, small enough for floats to represent all relevant sums exactly.
    """
    weight, need = model.uncapped(time)
    with np.errstate(over="ignore"):  # an agent may do far more than a task needs
        steps = np.minimum(np.ceil(weight / (need / GRID)), GRID)
    return np.ascontiguousarray(steps.T), np.full(len(need), float(GRID))


@compiled
def cheapest_groups(
    weight: FloatArray, price: FloatArray, count: WholeArray, need: FloatArray, used: FloatArray
) -> FloatArray:
    """Return the cost of the cheapest group of each task, shape (t,), and add their agents of each class to `used`.

    Parameters
    ----------
    weight : ndarray, shape (t, k)
        Whole numbers, as those of `need`.
    price : ndarray, shape (k,)
        Whole numbers >= 0.
    count : ndarray of int64, shape (k,)
    need : ndarray, shape (t,)
    used : ndarray, shape (k,)
    """
    costs, classes, states = np.empty(len(need)), len(price), room_for_states(MAX_STATES)
    some, these, cost = np.empty(classes, dtype=np.int64), np.empty(classes), np.empty(classes)
    copies, group = np.empty(classes, dtype=np.int64), np.empty(classes, dtype=np.int64)
    for j in range(len(need)):
        size = 0
        for k in range(classes):
            if weight[j, k] > 0:
                some[size], these[size], cost[size], copies[size] = k, weight[j, k], price[k], count[k]
                size += 1
        costs[j] = cheapest_by_states(
            these[:size], cost[:size], copies[:size], need[j], CHEAPER, states, group[:size], used[:0]
        )
        for q in range(size):
            used[some[q]] += group[q]
    return costs


def compile_loops() -> None:
    """Compile the loop, or load it from the cache, so that it does not delay a run."""
    ones = np.ones(2)
    cheapest_groups(np.ones((1, 2)), ones, np.ones(2, dtype=np.int64), ones[:1], np.zeros(2))
