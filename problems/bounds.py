"""Lower bounds on the makespan, and on the energy at a makespan, that hold for every allocation."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from alloc.problems.classes import agent_classes
from alloc.problems.evaluation import completion_time
from alloc.problems.instance import FloatArray, Instance

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

SAFETY = 1e-7
"""Relative amount by which a bound from floating-point linear programming is lowered."""

LP_SIZE_LIMIT = 100_000
"""Pairs of agent class and task beyond which no linear programme is built (about a second)."""


def makespan_lower_bound(instance: Instance) -> float:
    """Return a lower bound on the makespan of every allocation that serves all tasks, in hours.

    The best of four: all abilities against all workloads; each task against all who can reach it; for every k the
    m - k smallest workloads against all but the k largest abilities, as k agents serve at most k tasks; and, where
    abilities are integers, the least T at which the demands rounded up, ceil(h_j / T), fit into the sum of abilities.
    Takes O(n log n + origins * m) time.
    """
    work = np.sort(instance.workload[instance.workload > 0])
    if not len(work):
        return 0.0
    ability = np.sort(instance.ability)
    usable = float(ability.sum())
    bound = max(_dropping_bound(work, ability), _reach_bound(instance))
    if instance.has_travel_time:
        bound = max(bound, _arrival_bound(instance))
    elif (ability == np.round(ability)).all() and usable < 2**53:
        bound = max(bound, _rounding_bound(work, usable, bound))
    return bound


def _dropping_bound(work: FloatArray, ability: FloatArray) -> float:
    """For each k: total of the m - k smallest workloads over total of the n - k smallest abilities."""
    most = min(len(work), len(ability))
    load = np.cumsum(work)[::-1][:most]
    rate = np.cumsum(ability)[::-1][:most]
    return float((load / rate).max())


def _reach_bound(instance: Instance) -> float:
    """Each task alone with all who can reach it."""
    per_origin = np.bincount(instance.reach.origin, weights=instance.ability, minlength=len(instance.reach.mask))
    rate = per_origin @ instance.reach.mask
    needed = (instance.workload > 0) & (rate > 0)
    return float((instance.workload[needed] / rate[needed]).max(initial=0.0))


def _arrival_bound(instance: Instance) -> float:
    """All agents at once, each from the hour at which it could reach its nearest task."""
    needed = instance.workload > 0
    nearest = np.where(instance.reach.mask & needed, instance.reach.distance, np.inf).min(axis=1)
    nearest = nearest[instance.reach.origin]
    arrival = np.divide(nearest, instance.speed, out=np.full(instance.n, np.inf), where=np.isfinite(nearest))
    able = np.isfinite(arrival)
    if not able.any():
        return 0.0
    return completion_time(float(instance.workload.sum()), instance.ability[able], arrival[able])


def _rounding_bound(work: FloatArray, total: float, bound: float) -> float:
    """Least T >= `bound` with sum_j ceil(h_j / T) <= total."""

    def demand(time: float) -> FloatArray:
        return np.ceil(work / time * (1 - 1e-12))

    if demand(bound).sum() <= total:
        return bound
    low, high = bound, float(work[-1])
    if demand(high).sum() > total:
        return bound  # fewer units of ability than tasks: nothing that rounding could add
    while high > low * (1 + 1e-9):
        middle = (low + high) / 2
        low, high = (low, middle) if demand(middle).sum() <= total else (middle, high)
    return max(bound, float((work / demand(high)).max()))


def lp_makespan_lower_bound(instance: Instance, time_limit_s: float = 10.0) -> float | None:
    """Return the makespan of the best fractional allocation, in hours, or None where that is not at hand.

    The linear programme gives fractions of agents, per class and task, to the tasks that they can reach. Not for
    instances with travel times, nor beyond `LP_SIZE_LIMIT` or `time_limit_s`.
    """
    work = instance.workload
    classes = agent_classes(instance, by_place=False)
    if instance.has_travel_time or not (work > 0).any() or classes.size * instance.m > LP_SIZE_LIMIT:
        return None
    from scipy.sparse import csr_matrix, hstack, vstack

    scale = float(work.sum() / instance.ability.sum())
    kind, task = np.nonzero(classes.mask & (work > 0))
    share = classes.ability[kind] * scale / work[task]
    cover, limit = _rows(task, -share, instance.m), _rows(kind, np.ones(len(kind)), classes.size)
    ratio = csr_matrix(np.where(work > 0, 1.0, 0.0)[:, None])  # the last variable is scale / T, to be maximised
    constraints = vstack([hstack([cover, ratio]), hstack([limit, csr_matrix((classes.size, 1))])])
    cost = np.zeros(len(kind) + 1)
    cost[-1] = -1.0
    best = _minimum(cost, constraints, np.concatenate([np.zeros(instance.m), classes.count]), time_limit_s)
    return None if best is None or best >= 0 else -scale / best * (1 - SAFETY)


def energy_lower_bound(instance: Instance, makespan: float, time_limit_s: float = 10.0) -> float | None:
    """Return a lower bound on the energy of every allocation with at most this makespan, or None if none is at hand.

    The linear programme buys ability for each task at the energy of the flight; an agent that could do a task alone
    within `makespan` counts as just enough for it. None beyond `LP_SIZE_LIMIT` or
    `time_limit_s`, or if `makespan` is too small.

    Parameters
    ----------
    makespan : float
        In hours; every task with workload must be done by then.
    """
    work = instance.workload
    classes = agent_classes(instance, by_place=True)
    if classes.size * instance.m > LP_SIZE_LIMIT:
        return None
    from scipy.sparse import vstack

    kind, task = np.nonzero(classes.mask & (work > 0))
    if not len(kind) or instance.energy_per_distance == 0:
        return 0.0
    distance = classes.distance[kind, task]
    hours = np.maximum(0.0, makespan * (1 + SAFETY) - distance / classes.speed[kind])
    share = np.minimum(1.0, classes.ability[kind] * hours / work[task])
    constraints = vstack([_rows(task, -share, instance.m), _rows(kind, np.ones(len(kind)), classes.size)])
    limits = np.concatenate([np.where(work > 0, -1.0, 0.0), classes.count])
    best = _minimum(distance, constraints, limits, time_limit_s)
    return None if best is None else max(0.0, best * instance.energy_per_distance * (1 - SAFETY))


def _rows(row: NDArray[np.intp], value: FloatArray, count: int) -> "csr_matrix":
    """One column per pair of class and task, with a single entry in its row."""
    from scipy.sparse import csr_matrix

    return csr_matrix((value, (row, np.arange(len(row)))), shape=(count, len(row)))


def _minimum(cost: FloatArray, constraints: "csr_matrix", limits: FloatArray, time_limit_s: float) -> float | None:
    from scipy.optimize import linprog

    answer = linprog(cost, A_ub=constraints, b_ub=limits, method="highs", options={"time_limit": time_limit_s})
    return float(answer.fun) if answer.status == 0 else None
