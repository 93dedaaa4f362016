"""The least makespan, and the least cost within it, of instances with few agents, by enumeration of all groups."""

import sys
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.problems import Instance
from alloc.problems.bounds import ROUNDING
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, IntArray

MAX_AGENTS, MAX_PAIRS = 12, 600_000
"""Maximum numbers of agents, and of pairs of disjoint groups over all tasks, which take a few milliseconds."""


class Optimum(NamedTuple):
    """The optimum over all plans that serve all tasks.

    Attributes
    ----------
    hours : float
        The least makespan.
    within : float
        Makespan up to which plans count as equally fast, in hours.
    cost : float
        The least energy, including prices of moves, of a plan within that makespan.
    """

    hours: float
    within: float
    cost: float


def is_tiny(instance: Instance) -> bool:
    """Return whether all groups of agents can be enumerated within milliseconds."""
    return instance.n <= MAX_AGENTS and 3**instance.n * instance.m <= MAX_PAIRS


def optimum(instance: Instance, tolerance: MakespanTolerance) -> Optimum | None:
    """Return the optimum, or None if no plan serves all tasks.

    By dynamic programming over the tasks: of a set U of agents, a group S does the next task, and the rest of U does
    the tasks before it; there are 3^n such pairs for each task.

    Parameters
    ----------
    instance : Instance
        One for which `is_tiny` holds.
    tolerance : MakespanTolerance
        How much slower than the fastest plan the cheapest may be.
    """
    hours, cost = _groups(instance)
    with np.errstate(over="ignore"):
        least = _least(hours, np.maximum)
        if not np.isfinite(least):
            return None
        within = last_equal(last_equal(tolerance.hours(least)))
        cheapest = _least(np.where(hours <= within, cost, np.inf), np.add) * (1 - ROUNDING)
    most = sys.float_info.max
    return Optimum(min(least * (1 - ROUNDING), most), within, min(cheapest, most))


def _groups(instance: Instance) -> tuple[FloatArray, FloatArray]:
    """Return completion time in hours and cost of each task that has workload, for each group of agents.

    Both have the shape (tasks, 2^n); bit i of a group stands for agent i. They are ``inf`` if a member cannot take the
    task. With arrival times a, abilities w and the workload h, the completion time is the minimum of
    (h + sum w a) / sum w over subsets of the group.
    """
    n, reach = instance.n, instance.reach
    tasks = np.flatnonzero(instance.workload > 0)
    distance, able, price = (table[reach.origin][:, tasks] for table in (reach.distance, reach.mask, reach.cost))
    member = (np.arange(1 << n)[:, None] >> np.arange(n)) & 1
    arrival = np.where(able, distance, 0.0) / instance.speed[:, None]
    with np.errstate(divide="ignore", over="ignore"):
        load = instance.workload[tasks] + member @ (instance.ability[:, None] * arrival)
        hours = (load / (member @ instance.ability)[:, None]).T
        cost = (member @ np.where(able, price, 0.0)).T.astype(np.float64) * reach.energy_per_distance
    for i in range(n if instance.has_travel_time else 0):
        with_it = np.flatnonzero(member[:, i])
        hours[:, with_it] = np.minimum(hours[:, with_it], hours[:, with_it - (1 << i)])
    astray = (member @ np.logical_not(able)).T > 0
    hours[astray], cost[astray] = np.inf, np.inf
    cost[:, 0] = np.inf  # the empty group serves no task
    return hours, cost


def _least(value: FloatArray, joined: np.ufunc) -> float:
    """Return the least value over all choices of disjoint groups, one per task, combined by `joined`; or ``inf``."""
    group, rest, first = _disjoint(value.shape[1].bit_length() - 1)
    least = np.full(value.shape[1], np.inf)
    least[0] = 0.0
    for of_task in value:
        least = np.minimum.reduceat(joined(least[rest], of_task[group]), first)
    return float(least.min())


@lru_cache(MAX_AGENTS)
def _disjoint(n: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return all pairs of disjoint groups of `n` agents, sorted by union, and the index where each union begins."""
    group, rest = np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp)
    for i in range(n):
        bit = 1 << i
        group, rest = np.concatenate([group, group | bit, group]), np.concatenate([rest, rest, rest | bit])
    order = np.argsort(group | rest, kind="stable")
    union = (group | rest)[order]
    return group[order], rest[order], np.flatnonzero(np.diff(union, prepend=-1))
