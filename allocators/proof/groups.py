"""The least makespan, and the least cost within it, of instances with a handful of agents: all groups are tried."""

import sys
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.problems import Instance
from alloc.problems.bounds import ROUNDING
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, IntArray

MOST_AGENTS, MOST_PAIRS = 12, 600_000
"""Agents, and pairs of disjoint groups over all tasks, up to which all are tried; so many take some milliseconds."""


class Optimum(NamedTuple):
    """What no plan that serves all tasks falls below.

    Attributes
    ----------
    hours : float
        The least makespan.
    within : float
        Makespan up to which plans count as equally fast, in hours.
    cost : float
        The least energy and price of moves of a plan within that.
    """

    hours: float
    within: float
    cost: float


def is_tiny(instance: Instance) -> bool:
    """Return whether all groups of agents can be tried within milliseconds."""
    return instance.n <= MOST_AGENTS and 3**instance.n * instance.m <= MOST_PAIRS


def optimum(instance: Instance, tolerance: MakespanTolerance) -> Optimum | None:
    """Return what is least, None where no plan serves all tasks.

    By dynamic programming over the tasks: of the agents in U, a group S does the next task, and the others of U do the
    tasks before; 3^n such pairs for each task.

    Parameters
    ----------
    instance : Instance
        A tiny one.
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
    """Return hours and cost of each task with work by each group of agents, ``inf`` where one cannot take it.

    Both of shape (tasks, 2^n); bit i of a group stands for agent i. With the arrivals a of a group, its rate w and the
    workload h, the task takes the least of (h + sum w a) / sum w over its members that have arrived, in any order.
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
    cost[:, 0] = np.inf  # nobody serves no task
    return hours, cost


def _least(value: FloatArray, joined: np.ufunc) -> float:
    """Return the least of all values of disjoint groups, one for each task, joined by `joined`; ``inf`` for none."""
    group, rest, first = _disjoint(value.shape[1].bit_length() - 1)
    least = np.full(value.shape[1], np.inf)
    least[0] = 0.0
    for of_task in value:
        least = np.minimum.reduceat(joined(least[rest], of_task[group]), first)
    return float(least.min())


@lru_cache(MOST_AGENTS)
def _disjoint(n: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return all pairs of disjoint groups of `n` agents by their union, and where each union begins."""
    group, rest = np.zeros(1, dtype=np.intp), np.zeros(1, dtype=np.intp)
    for i in range(n):
        bit = 1 << i
        group, rest = np.concatenate([group, group | bit, group]), np.concatenate([rest, rest, rest | bit])
    order = np.argsort(group | rest, kind="stable")
    union = (group | rest)[order]
    return group[order], rest[order], np.flatnonzero(np.diff(union, prepend=-1))
