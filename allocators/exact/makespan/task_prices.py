"""A lower bound on the makespan by prices of tasks, for up to millions of agents with short reach.

By weak duality of the linear programme of single agents, T is infeasible if for some prices >= 0 the total value of all
agents, each on its most valuable task within reach, is less than that of all workloads. Multiplicative updates raise
the prices of tasks with too few agents and lower the others; each takes one pass over the pairs within reach.
"""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray

Int32Array = NDArray[np.int32]

SAFETY = 1e-9
"""Relative shortfall of the agents' value required for a proof, to allow for rounding errors in a million terms."""

FIRST_STEP, LAST_STEP = 2e-3, 1e-5
"""Relative change of a price for a shortfall or excess of the whole need, at the start and at the end."""

LARGEST_SHORTFALL = 3.0
"""Cap on the relative shortfall or excess in price updates."""

PATIENCE = 8
"""Passes without progress after which steps are halved."""

INERTIA = 0.5
"""Share of the last direction that is added to the next (momentum)."""

LARGEST_RISE = 0.005
"""Largest relative increase of T in one step."""


def bound_by_task_prices(instance: Instance, low: float, high: float, end: float, stopped: Callable[[], bool]) -> float:
    """Return a T from `low` to `high` such that no plan that serves all tasks is faster.

    Parameters
    ----------
    instance : Instance
        Its reach must be short enough for a neighbour list.
    low, high : float
        Hours; a proven lower bound, and the makespan of a plan.
    end : float
        Time of the monotonic clock at which to end.
    stopped : callable
    """
    near = instance.reach.neighbours
    assert near is not None
    work = instance.workload
    price, best_price = np.where(work > 0, 1.0, 0.0), np.where(work > 0, 1.0, 0.0)
    direction, done, some = np.zeros(len(work)), np.zeros(len(work)), work > 0
    at, best, step, stale = low, 0.0, FIRST_STEP, 0
    while step >= LAST_STEP and low < high and not stopped() and time.monotonic() < end:
        done[:] = 0.0
        pairs = near.first, near.task, near.distance, instance.reach.origin
        value = value_of_agents(*pairs, instance.ability, instance.speed, price, at, done)
        ratio = float(price @ work) / max(value * at, 1e-300)
        if ratio > 1 + SAFETY:
            low = at
            at *= 1 + min(LARGEST_RISE, ratio - 1)
        if ratio > min(1.0, best + LAST_STEP / 10):
            best, best_price, stale = min(1.0, ratio), price, 0
        else:
            stale += 1
        if stale > PATIENCE:
            price, step, stale = best_price, step / 2, 0
            direction[:] = 0.0
            continue
        shortfall = np.where(some, 1 - done * at / np.where(some, work, 1.0), 0.0)
        direction = shortfall + INERTIA * direction
        price = price * np.exp(step * np.clip(direction, -LARGEST_SHORTFALL, LARGEST_SHORTFALL))
        price /= price.mean()
    return min(low, high)


@compiled
def value_of_agents(
    first: IntArray,
    task: Int32Array,
    distance: FloatArray,
    origin: IntArray,
    ability: FloatArray,
    speed: FloatArray,
    price: FloatArray,
    time: float,
    done: FloatArray,
) -> float:
    """Return the total value of the agents' work per hour by `time`, each on its most valuable task.

    Parameters
    ----------
    first, task, distance
        Pairs within reach, as in `Neighbours`.
    origin : ndarray of int, shape (n,)
        Row of each agent in `first`.
    ability, speed : ndarray, shape (n,)
    price : ndarray, shape (m,)
        Value of a unit of each workload.
    done : ndarray, shape (m,)
        Output: the work per hour on each task by the agents that chose it.
    """
    total = 0.0
    for i in range(len(ability)):
        most, chosen, rate = 0.0, -1, 0.0
        for p in range(first[origin[i]], first[origin[i] + 1]):
            supplied = ability[i] * (1 - distance[p] / (speed[i] * time))
            value = supplied * price[task[p]]
            if value > most:
                most, chosen, rate = value, task[p], supplied
        if chosen >= 0:
            done[chosen] += rate
            total += most
    return total


def compile_loops() -> None:
    """Compile the loop for the read-only arrays of neighbour lists, so that it does not delay a run."""
    instance = Instance(ability=[1.0], workload=[1.0])
    near, zeros = instance.reach.neighbours, np.zeros(1)
    assert near is not None
    pairs = near.first, near.task, near.distance, instance.reach.origin
    value_of_agents(*pairs, instance.ability, instance.speed, zeros, 1.0, zeros)
