"""A lower bound on the makespan by prices of tasks, for up to millions of agents with short reach.

By weak duality of the linear programme of single agents, T is impossible if with some prices >= 0 the value of all
agents together, each on the task within its reach where it has the most, is less than that of all workloads. Prices of
tasks with too few agents rise and others fall, all by factors; each change takes one pass over the pairs within reach.
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
"""Part by which the value of all agents must fall short before that counts as a proof: rounding of a million terms."""

FIRST_STEP, LAST_STEP = 2e-3, 1e-5
"""Relative change of a price whose task is short of, or has in excess, all that it needs, at first and at the end."""

LARGEST_SHORTFALL = 3.0
"""Shortfall or excess beyond which a price changes no faster."""

PATIENCE = 8
"""Passes without progress after which steps are halved."""

INERTIA = 0.5
"""Part of the last direction that is added to the next."""

LARGEST_RISE = 0.005
"""Largest relative rise of T at once."""


def bound_by_task_prices(instance: Instance, low: float, high: float, end: float, stopped: Callable[[], bool]) -> float:
    """Return a T from `low` to `high` such that no plan that serves all tasks is faster.

    Parameters
    ----------
    instance : Instance
        Its reach is short enough for a list of neighbours.
    low, high : float
        Hours; a proven bound, and the makespan of a plan.
    end : float
        When to end, on the monotonic clock.
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
    """Return the value of all agents' work per hour by `time`, each on the task where it has the most.

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
        Gets what the agents do per hour on the tasks that they chose.
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
    """Call the loop on an instance with neighbours, whose arrays are read-only, so that no run waits for it."""
    instance = Instance(ability=[1.0], workload=[1.0])
    near, zeros = instance.reach.neighbours, np.zeros(1)
    assert near is not None
    pairs = near.first, near.task, near.distance, instance.reach.origin
    value_of_agents(*pairs, instance.ability, instance.speed, zeros, 1.0, zeros)
