"""A lower bound on the makespan by linear programmes with fractional agents.

At a fixed T, the programme maximises the smallest share of its need that a task gets. Its dual prices of the tasks
exclude more than this T: with any prices >= 0, T is infeasible if the total value of all agents, each on its most
valuable task, is less than that of all needs. So after each solution, T is raised to the largest value that the last
prices exclude, which converges in a few solutions (Newton's method; Dinkelbach (1967), doi:10.1287/mnsc.13.7.492).
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse import csr_array, hstack, vstack

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.model import Model
from alloc.allocators.runtime.linear_programme import minimise
from alloc.problems.instance import FloatArray

MAX_PAIRS = 400_000
"""Number of pairs of class and task above which a linear programme takes too long."""

SAFETY = 1e-10
"""Share of the workload by which fractional agents must fall short before that counts as a proof."""

CLOSE = 1e-5
"""Relative increase of the bound below which the method ends."""

PRECISION = 1e-9
"""Relative precision of the largest T that given prices exclude."""


def relaxed_lower_bound(
    model: Model, low: float, high: float, seconds: float, should_stop: Callable[[], bool]
) -> tuple[float, FloatArray | None]:
    """Return (nearly) the largest T from `low` to `high` such that no plan, even with fractional agents, is faster.

    Also return the value of a unit of each workload near that T, shape (t,), or None.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low, high : float
        Hours; a proven lower bound, and the makespan of a plan.
    seconds : float
        Time limit.
    should_stop : callable
        Called every 20 ms.
    """
    end, last = time.monotonic() + seconds, None
    while len(model.class_of_pair) <= MAX_PAIRS and low < high and not should_stop():
        demand = model.at(low)
        if demand.trivially_infeasible:
            low = _largest(model, low, high, lambda demand: demand.trivially_infeasible)
            low = max(low * (1 + PRECISION), model.next_makespan(low))
            continue
        price = _dual_prices(demand, end - time.monotonic(), should_stop)
        last = last if price is None else price / model.workload * demand.need
        if price is None or not _excludes(price, demand):
            break
        proven = _largest(model, low, high, partial(_excludes, price))
        raised = max(proven, model.next_makespan(proven))
        if raised <= low * (1 + CLOSE):
            return min(raised, high), last
        low = raised
    return min(low, high), last


def _dual_prices(demand: Demand, seconds: float, should_stop: Callable[[], bool]) -> FloatArray | None:
    """Return the price of a unit of each need, shape (t,), or None if time is up."""
    if seconds <= 0:
        return None
    pairs, tasks, classes = len(demand.class_of_pair), len(demand.need), len(demand.count)
    columns = np.arange(pairs)
    part = demand.weight / demand.need[demand.task_of_pair]
    share = csr_array((part, (demand.task_of_pair, columns)), shape=(tasks, pairs))
    used = csr_array((np.ones(pairs), (demand.class_of_pair, columns)), shape=(classes, pairs))
    least = csr_array(np.ones((tasks, 1)))
    matrix = vstack([hstack([-share, least]), hstack([used, csr_array((classes, 1))])])
    limits = np.concatenate([np.zeros(tasks), demand.count])
    upper = np.append(demand.max_count, np.inf)
    cost = np.append(np.zeros(pairs), -1.0)
    answer = minimise(cost, matrix, limits, should_stop=should_stop, upper=upper, seconds=seconds)
    return None if answer is None else answer.multiplier[:tasks] / demand.need


def _largest(model: Model, low: float, high: float, is_excluded: Callable[[Demand], bool]) -> float:
    """Return (nearly) the largest excluded T from `low`, which is excluded, to `high`."""
    if is_excluded(model.at(high)):
        return high
    while high - low > PRECISION * high:
        middle = (low + high) / 2
        low, high = (middle, high) if is_excluded(model.at(middle)) else (low, middle)
    return low


def _excludes(price: FloatArray, demand: Demand) -> bool:
    """Whether the value of all agents is less than that of all needs: a proof for any prices, by weak duality."""
    needed = float(price @ demand.need)
    return _largest_value(demand, price[demand.task_of_pair] * demand.weight) < needed * (1 - SAFETY)


def _largest_value(demand: Demand, value: FloatArray) -> float:
    """Return the largest total value of all agents, given the value of one agent of each pair."""
    order = np.lexsort((-value, demand.class_of_pair))
    agent_class, most = demand.class_of_pair[order], demand.max_count[order]
    before = np.cumsum(most) - most
    first = np.searchsorted(agent_class, agent_class)  # where the pairs of each class begin
    taken = np.clip(demand.count[agent_class] - (before - before[first]), 0, most)
    return float(taken @ value[order])
