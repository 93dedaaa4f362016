"""Lower bounds on the makespan, and on the energy at a given makespan, that hold for every allocation.

Bounds by linear programmes are computed from the solver's dual multipliers by weak duality: any multipliers >= 0 give
a valid bound, so that the solver's tolerances do not matter.
"""

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from alloc.problems.arguments import of_type, real
from alloc.problems.classes import agent_classes, count_classes
from alloc.problems.distances.neighbours import nearest_distance
from alloc.problems.evaluation import completion_time, last_equal
from alloc.problems.instance import FloatArray, Instance, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

ROUNDING = 1e-12
"""Relative amount by which a bound is lowered to allow for rounding errors in sums of floats."""

ORDINARY = (2.0**-7, 2.0**20)
"""Range of costs that are passed to solvers without scaling."""

DEAREST = 2.0**40
"""Cap on scaled costs, which keeps bounds valid; solvers treat much larger costs as infinite."""

MAX_DOUBLINGS = 1000
"""Largest exponent k of a scale 2^k, such that both 2^k and 2^-k are normal floats."""

SCARCE = 32
"""Tasks for which reachable ability is summed where the reachability table is too large to build."""

SAMPLED_PAIRS = 4_000_000
"""Pairs of a sampled agent and a task that are examined to find the `SCARCE` tasks."""

LP_SIZE_LIMIT = 500_000
"""Pairs of agent class and task beyond which no linear programme is built."""

LP_PAIRS_PER_SECOND = 200_000
"""Pairs per second of the time limit beyond which a linear programme is not started."""


def makespan_lower_bound(instance: Instance) -> float:
    """Return a lower bound on the makespan of every allocation that serves all tasks, in hours.

    The maximum of four bounds: total workload over total ability; each workload over the ability of all agents that
    can reach the task; for every k, the m - k smallest workloads over all but the k largest abilities, as k agents
    serve at most k tasks; and, if abilities are integers, the least T with sum_j ceil(h_j / T) <= total ability.
    Takes O(n log n + origins * m) time.

    Parameters
    ----------
    instance : Instance
    """
    of_type(instance, Instance, "instance")
    work = np.sort(instance.workload[instance.workload > 0])
    if not len(work):
        return 0.0
    ability = np.sort(instance.ability)
    usable = float(ability.sum())
    with np.errstate(over="ignore"):
        bound = max(_dropping_bound(work, ability), _reach_bound(instance))
        if instance.has_travel_time:
            bound = max(bound, _arrival_bound(instance))
        elif (ability == np.round(ability)).all() and usable < 2**53:
            bound = max(bound, _rounding_bound(work, usable, bound))
    return min(bound, sys.float_info.max)


def _dropping_bound(work: FloatArray, ability: FloatArray) -> float:
    """Return the maximum over k of the m - k smallest workloads over the n - k smallest abilities, each summed."""
    most = min(len(work), len(ability))
    load = np.cumsum(work)[::-1][:most]
    rate = np.cumsum(ability)[::-1][:most]
    return float((load / rate).max())


def _reach_bound(instance: Instance) -> float:
    """Return the longest time that a task needs with all agents that can reach it."""
    reach = instance.reach
    if not reach.has_table:
        return 0.0 if reach.is_complete else _reach_bound_of_scarce(instance)
    per_origin = np.bincount(reach.origin, weights=instance.ability, minlength=len(reach.place))
    rate = per_origin @ reach.mask
    needed = (instance.workload > 0) & (rate > 0)
    return float((instance.workload[needed] / rate[needed]).max(initial=0.0))


def _reach_bound_of_scarce(instance: Instance) -> float:
    """Return `_reach_bound` over `SCARCE` tasks: those with most work per ability in reach, by a sample of agents."""
    reach, work = instance.reach, instance.workload
    size = min(10 * SCARCE, max(1, SAMPLED_PAIRS // instance.m))
    sample = np.unique(np.linspace(0, instance.n - 1, size).astype(np.intp))
    rate = instance.ability[sample] @ reach.rows(reach.origin[sample])[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        scarce = np.argsort(-np.where(work > 0, work / rate, 0.0), kind="stable")[:SCARCE]
    rates = [(work[j], float(instance.ability[reach.agents_of(j)].sum())) for j in scarce.tolist()]
    return max((load / ability for load, ability in rates if ability > 0), default=0.0)


def _arrival_bound(instance: Instance) -> float:
    """Return the hour at which all work is done if each agent works from its arrival at its nearest task on."""
    needed = instance.workload > 0
    reach = instance.reach
    if reach.has_table:
        nearest = np.where(reach.mask & needed, reach.distance, np.inf).min(axis=1)
    else:
        nearest = nearest_distance(reach, needed)
    nearest = nearest[reach.origin]
    arrival = np.divide(nearest, instance.speed, out=np.full(instance.n, np.inf), where=np.isfinite(nearest))
    able = np.isfinite(arrival)
    if not able.any():
        return 0.0
    return completion_time(float(instance.workload.sum()), instance.ability[able], arrival[able])


def _rounding_bound(work: FloatArray, total: float, bound: float) -> float:
    """Return the least T >= `bound` with sum_j ceil(h_j / T) <= total."""

    def demand(time: float) -> FloatArray:
        return np.ceil(work / time * (1 - ROUNDING))

    if bound == 0 or demand(bound).sum() <= total:
        return bound
    low, high = bound, float(work[-1])
    if demand(high).sum() > total:
        return bound  # fewer units of ability than tasks: rounding cannot improve the bound
    while high > low * (1 + 1e-9):
        middle = (low + high) / 2
        if not low < middle < high:
            return bound  # near 0, the spacing of floats is too coarse to decide
        low, high = (low, middle) if demand(middle).sum() <= total else (middle, high)
    return max(bound, float((work / demand(high)).max()))


def lp_makespan_lower_bound(instance: Instance, time_limit_s: float = 10.0) -> float | None:
    """Return the makespan of the best fractional allocation, in hours, or None if it is not available.

    The linear programme assigns fractions of agents, per class, to the tasks that they can reach. None for
    instances with travel times, and if it would take more than `time_limit_s` or `LP_SIZE_LIMIT` pairs.

    Parameters
    ----------
    instance : Instance
    time_limit_s : float
        Seconds for the solver, >= 0.
    """
    _check(instance, time_limit_s)
    work = instance.workload
    if instance.has_travel_time or not (work > 0).any() or _is_too_large(instance, time_limit_s, by_place=False):
        return None
    classes = agent_classes(instance, by_place=False)
    from scipy.sparse import csr_matrix, hstack, vstack

    scale = makespan_lower_bound(instance)
    kind, task = np.nonzero(classes.mask & (work > 0))
    with np.errstate(over="ignore"):
        share = classes.ability[kind] * scale / work[task]
    if not np.isfinite(share).all():
        return None
    need, limit = _rows(task, -share, instance.m), _rows(kind, np.ones(len(kind)), classes.size)
    ratio = csr_matrix(np.where(work > 0, 1.0, 0.0)[:, None])  # the last variable is scale / T, to be maximised
    constraints = vstack([hstack([need, ratio]), hstack([limit, csr_matrix((classes.size, 1))])])
    cost = np.append(np.zeros(len(kind)), -1.0)
    price = _multipliers(cost, constraints, np.append(np.zeros(instance.m), classes.count), time_limit_s)
    if price is None:
        return None
    # scale / T sum_j price_j <= sum_jk price_j share_kj x_kj <= sum_k count_k max_j price_j share_kj
    price = price[: instance.m] * (work > 0)
    value = float(classes.count @ _largest(kind, price[task] * share, classes.size))
    return scale * float(price.sum()) / value * (1 - ROUNDING) if value > 0 else None


def energy_lower_bound(instance: Instance, makespan: float, time_limit_s: float = 10.0) -> float | None:
    """Return a lower bound on the energy of every allocation with at most this makespan, or None if not available.

    If the instance has a price on moves, the bound is on the sum of both. The linear programme covers the demand of
    each task at least cost; an agent's ability counts at most as much as the demand of its task. None if it would
    take more than `time_limit_s` or `LP_SIZE_LIMIT` pairs, or if `makespan` is too small.

    Parameters
    ----------
    makespan : float
        In hours; every task with workload must be done by then.
    """
    _check(instance, time_limit_s)
    real(makespan, "makespan")
    work = instance.workload
    if _is_too_large(instance, time_limit_s, by_place=True):
        return None
    classes = agent_classes(instance, by_place=True)
    from scipy.sparse import vstack

    kind, task = np.nonzero(classes.mask & (work > 0))
    if not len(kind) or instance.reach.energy_per_distance == 0:
        return 0.0
    distance, flight = classes.distance[kind, task], classes.cost[kind, task]
    scale = scale_to_one(typical_distance(flight))
    with np.errstate(over="ignore"):
        cost = np.minimum(flight * scale, DEAREST)
        hours = np.maximum(0.0, last_equal(makespan) - distance / classes.speed[kind])
        share = np.minimum(1.0, classes.ability[kind] * hours / work[task])
    constraints = vstack([_rows(task, -share, instance.m), _rows(kind, np.ones(len(kind)), classes.size)])
    limits = np.append(np.where(work > 0, -1.0, 0.0), classes.count)
    price = _multipliers(cost, constraints, limits, time_limit_s)
    if price is None:
        return None
    # the reduced cost of an agent of class k is at least -max(0, max_j price_j share_kj - cost_kj)
    price = price[: instance.m] * (work > 0)
    saved = float(classes.count @ _largest(kind, price[task] * share - cost, classes.size))
    least = max(0.0, float(price.sum()) * (1 - ROUNDING) - saved)
    return min(least / scale * instance.reach.energy_per_distance, sys.float_info.max)


def typical_distance(distance: FloatArray) -> float:
    """Return the median of the finite distances > 0, or 1 if there are none."""
    away = distance[(distance > 0) & (distance < np.inf)]
    return float(np.median(away)) if len(away) else 1.0


def scale_to_one(typical: float) -> float:
    """Return the power of two, exact in floats, that scales costs of the size of `typical` > 0 to about 1.

    Solvers have absolute tolerances, below which small costs would vanish. The scale is 1 for `ORDINARY` costs.
    """
    if ORDINARY[0] <= typical <= ORDINARY[1]:
        return 1.0
    return math.ldexp(1.0, max(-MAX_DOUBLINGS, min(MAX_DOUBLINGS, -math.frexp(typical)[1])))


def _check(instance: Instance, time_limit_s: float) -> None:
    of_type(instance, Instance, "instance")
    real(time_limit_s, "time_limit_s")


def _is_too_large(instance: Instance, time_limit_s: float, *, by_place: bool) -> bool:
    most = min(LP_SIZE_LIMIT, LP_PAIRS_PER_SECOND * time_limit_s)
    return instance.m > most or count_classes(instance, by_place=by_place) * instance.m > most


def _largest(row: IntArray, value: FloatArray, count: int) -> FloatArray:
    """Return the largest value in each row, at least 0."""
    largest = np.zeros(count)
    np.maximum.at(largest, row, value)
    return largest


def _rows(row: IntArray, value: FloatArray, count: int) -> "csr_matrix":
    """Return a matrix with a column per pair of class and task, which has a single entry, in the pair's row."""
    from scipy.sparse import csr_matrix

    return csr_matrix((value, (row, np.arange(len(row)))), shape=(count, len(row)))


def _multipliers(
    cost: FloatArray, constraints: "csr_matrix", limits: FloatArray, time_limit_s: float
) -> FloatArray | None:
    """Minimise ``cost @ x`` with ``constraints @ x <= limits`` and x >= 0; return a multiplier >= 0 per constraint."""
    from scipy.optimize import linprog

    answer = linprog(cost, A_ub=constraints, b_ub=limits, method="highs", options={"time_limit": time_limit_s})
    return np.maximum(0.0, -answer.ineqlin.marginals) if answer.status == 0 else None
