"""How far linear programmes alone push the makespan's lower bound, for where tests with integers take too long."""

import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse import csr_array, hstack, vstack

from alloc.allocators.exact.model import Demand, Model
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import FloatArray

MOST_PAIRS = 100_000
"""Pairs of class and task beyond which a linear programme takes too long to be worth it."""

SAFETY = 1e-6
"""Part of the workload that a linear programme must find missing before it counts as a proof."""

CLOSE = 1e-5
"""Relative distance at which the bisection ends."""


def relaxed_lower_bound(
    model: Model, low: float, high: float, seconds: float, should_stop: Callable[[], bool]
) -> float:
    """Return the largest T between `low` and `high` found by bisection that not even fractions of agents can hold.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low, high : float
        Hours; a proven bound, and the makespan of a plan.
    seconds : float
        Time limit.
    should_stop : callable
        Asked all the while.
    """
    end = time.monotonic() + seconds
    if len(model.kind) > MOST_PAIRS:
        return low
    middle = low * (1 + CLOSE)
    while high - low > CLOSE * high and not should_stop():
        short = _falls_short(model.at(middle), end - time.monotonic(), should_stop)
        if short is None:
            return low
        low, high = (max(middle, model.after(middle)), high) if short else (low, middle)
        middle = (low + high) / 2
    return low


def _falls_short(demand: Demand, seconds: float, should_stop: Callable[[], bool]) -> bool | None:
    """Whether some task stays short however agents are split; None where that is not at hand in time."""
    if seconds <= 0:
        return None
    if demand.hopeless:
        return True
    pairs, tasks, kinds = len(demand.kind), len(demand.need), len(demand.count)
    columns = np.arange(pairs)
    part = demand.weight / demand.need[demand.goal]
    share = csr_array((part, (demand.goal, columns)), shape=(tasks, pairs))
    used = csr_array((np.ones(pairs), (demand.kind, columns)), shape=(kinds, pairs))
    least = csr_array(np.ones((tasks, 1)))
    matrix = vstack([hstack([-share, least]), hstack([used, csr_array((kinds, 1))])])
    limits = np.concatenate([np.zeros(tasks), demand.count])
    bounds = np.column_stack([np.zeros(pairs + 1), np.append(demand.most, 1.0)])
    cost = np.append(np.zeros(pairs), -1.0)

    def work() -> OptimizeResult:
        return linprog(cost, matrix, limits, bounds=bounds, method="highs", options={"time_limit": seconds})

    answer = run_native(work, should_stop, lambda: None)
    if answer is None or answer.status != 0:
        return None
    price = np.maximum(0.0, -answer.ineqlin.marginals[:tasks])  # any will do for the proof: weak duality
    return bool(_most_worth(demand, price[demand.goal] * part) < price.sum() * (1 - SAFETY))


def _most_worth(demand: Demand, worth: FloatArray) -> float:
    """Return the most that all agents together can be worth, given what one agent of each pair is."""
    order = np.lexsort((-worth, demand.kind))
    kind, most = demand.kind[order], demand.most[order]
    before = np.cumsum(most) - most
    first = np.searchsorted(kind, kind)  # where the pairs of each class begin
    taken = np.clip(demand.count[kind] - (before - before[first]), 0, most)
    return float(taken @ worth[order])
