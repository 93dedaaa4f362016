"""A lower bound on the makespan from linear programmes alone, for where probes with integers take too long."""

import time
from collections.abc import Callable

import numpy as np
from scipy.optimize import OptimizeResult, linprog
from scipy.sparse import csr_array, hstack, vstack

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import Verdict
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import FloatArray

MAX_PAIRS = 100_000
"""Pairs of class and task above which a linear programme takes too long."""

SAFETY = 1e-6
"""Part of the workload by which fractions of agents must fall short before that counts as a proof."""

CLOSE = 1e-5
"""Relative distance at which the bisection ends."""


def relaxed_lower_bound(
    model: Model, low: float, high: float, seconds: float, should_stop: Callable[[], bool]
) -> float:
    """Return the largest T between `low` and `high` that bisection finds infeasible even for fractions of agents.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low, high : float
        Hours; a proven bound, and the makespan of a plan.
    seconds : float
        Time limit.
    should_stop : callable
        Asked every 20 ms.
    """
    end = time.monotonic() + seconds
    if len(model.class_of_pair) > MAX_PAIRS:
        return low
    middle = low * (1 + CLOSE)
    while high - low > CLOSE * high and not should_stop():
        verdict = _solve_relaxation(model.at(middle), end - time.monotonic(), should_stop)
        if verdict is Verdict.UNKNOWN:
            return low
        if verdict is Verdict.INFEASIBLE:
            low = max(middle, model.next_makespan(middle))
        else:
            high = middle
        middle = (low + high) / 2
    return low


def _solve_relaxation(demand: Demand, seconds: float, should_stop: Callable[[], bool]) -> Verdict:
    """Maximise the least part of its need that a task gets from fractions of agents; the proof are the dual prices."""
    if seconds <= 0:
        return Verdict.UNKNOWN
    if demand.trivially_infeasible:
        return Verdict.INFEASIBLE
    pairs, tasks, classes = len(demand.class_of_pair), len(demand.need), len(demand.count)
    columns = np.arange(pairs)
    part = demand.weight / demand.need[demand.task_of_pair]
    share = csr_array((part, (demand.task_of_pair, columns)), shape=(tasks, pairs))
    used = csr_array((np.ones(pairs), (demand.class_of_pair, columns)), shape=(classes, pairs))
    least = csr_array(np.ones((tasks, 1)))
    matrix = vstack([hstack([-share, least]), hstack([used, csr_array((classes, 1))])])
    limits = np.concatenate([np.zeros(tasks), demand.count])
    bounds = np.column_stack([np.zeros(pairs + 1), np.append(demand.max_count, 1.0)])
    cost = np.append(np.zeros(pairs), -1.0)

    def work() -> OptimizeResult:
        return linprog(cost, matrix, limits, bounds=bounds, method="highs", options={"time_limit": seconds})

    answer = run_native(work, should_stop, lambda: None)
    if answer is None or answer.status != 0:
        return Verdict.UNKNOWN
    price = np.maximum(0.0, -answer.ineqlin.marginals[:tasks])  # any will do for the proof: weak duality
    largest = _largest_value(demand, price[demand.task_of_pair] * part)
    return Verdict.INFEASIBLE if largest < price.sum() * (1 - SAFETY) else Verdict.FEASIBLE


def _largest_value(demand: Demand, value: FloatArray) -> float:
    """Return the largest total value of all agents, given the value of one agent of each pair."""
    order = np.lexsort((-value, demand.class_of_pair))
    agent_class, most = demand.class_of_pair[order], demand.max_count[order]
    before = np.cumsum(most) - most
    first = np.searchsorted(agent_class, agent_class)  # where the pairs of each class begin
    taken = np.clip(demand.count[agent_class] - (before - before[first]), 0, most)
    return float(taken @ value[order])
