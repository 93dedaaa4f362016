"""The candidates of each agent: all tasks, or the nearest ones where there are many."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

SCARCE_SHARE = 4
"""One in so many candidates of each agent is kept for tasks that few agents have near."""

AMPLE = 3.0
"""Ability over need from the nearest agents up to which a task is added to their candidates."""

CHUNK = 2_000_000
"""Pairs of agent and task handled at once, to bound the memory."""

Ints = NDArray[np.int64]


class Candidates(NamedTuple):
    """Candidates of n agents, the last of which is being idle.

    Attributes
    ----------
    place : ndarray of int, shape (n, c)
        Task, or m for idle and where there are fewer tasks in reach than candidates.
    distance, cost : ndarray, shape (n, c)
        Distance, and cost of the flight, see `Reach.costs`.
    legal : ndarray of bool, shape (n, c)
    """

    place: Ints
    distance: NDArray[np.float64]
    cost: NDArray[np.float64]
    legal: NDArray[np.bool_]


def candidate_tasks(instance: Instance, near: int | None, plan: Ints | None) -> Candidates:
    """Return the candidates of each agent.

    Parameters
    ----------
    near : int or None
        Candidates besides being idle, at least 1; None, or as many as there are tasks, for all tasks.
    plan : ndarray of int, shape (n,), or None
        Places that must be among the candidates.
    """
    n, m = instance.n, instance.m
    if near is None or near >= m:
        reach, tasks = instance.reach, np.arange(m)
        distance, legal = reach.rows(reach.origin)
        cost = distance if reach.cost_is_distance else reach.costs(reach.origin[:, None], tasks, distance)
        return _with_idle(np.broadcast_to(tasks, (n, m)), distance, cost, legal, m)
    chosen = _nearest(instance, near)
    _include(chosen, instance.start_task, np.full(n, -1))
    if plan is not None:
        begins = (chosen[:, -1] == instance.start_task) & (near > 1)
        _include(chosen, plan, np.where(begins, -2, -1))
    known = chosen >= 0
    agent, task = np.broadcast_arrays(np.arange(n)[:, None], np.where(known, chosen, 0))
    legal = instance.reach.allows(agent, task) & known
    distance = cost = np.where(legal, instance.reach.distance_of(agent, task), 0.0)
    if not instance.reach.cost_is_distance:
        cost = np.where(legal, instance.reach.cost_of(agent, task), 0.0)
    return _with_idle(np.where(known, chosen, m), distance, cost, legal, m)


def _with_idle(
    task: Ints, distance: NDArray[np.float64], cost: NDArray[np.float64], legal: NDArray[np.bool_], idle: int
) -> Candidates:
    """Append being idle to the candidates, all of shape (n, c - 1)."""
    n = len(task)
    away = np.column_stack([distance, np.zeros(n)])
    return Candidates(
        np.column_stack([task, np.full(n, idle)]),
        away,
        away if cost is distance else np.column_stack([cost, np.zeros(n)]),
        np.column_stack([legal, np.ones(n, dtype=bool)]),
    )


def _nearest(instance: Instance, near: int) -> Ints:
    """Return the nearest tasks in reach, then scarce ones (`_add_scarce`); -1 for none; shape (n, near)."""
    reach, m = instance.reach, instance.m
    own = near - near // SCARCE_SHARE
    origins = len(reach.place)
    nearest = np.empty((origins, near), dtype=np.int64)
    useful = instance.workload > 0
    for first in range(0, origins, max(1, CHUNK // m)):
        rows = np.arange(first, min(origins, first + max(1, CHUNK // m)))
        distance, legal = reach.rows(rows)
        away = np.where(legal & useful, distance, np.inf)
        order = np.argpartition(away, near - 1, axis=1)[:, :near]
        order = np.take_along_axis(
            order, np.take_along_axis(away, order, axis=1).argsort(axis=1, kind="stable"), axis=1
        )
        nearest[rows] = np.where(np.isinf(np.take_along_axis(away, order, axis=1)), -1, order)
    chosen = nearest[reach.origin]
    _add_scarce(instance, chosen, own)
    return chosen


def _add_scarce(instance: Instance, chosen: Ints, own: int) -> None:
    """Put tasks that too little ability has near in the last columns of the agents nearest to them."""
    n, m = instance.n, instance.m
    kept = chosen[:, :own]
    ability = np.repeat(instance.ability[:, None], own, axis=1)[kept >= 0]
    near_ability = np.bincount(kept[kept >= 0], ability, minlength=m)
    fair = instance.workload / max(instance.workload.sum(), 1e-300) * instance.ability.sum()
    used = np.full(n, own)
    for task in np.flatnonzero(near_ability < AMPLE * fair).tolist():
        able = instance.reach.agents_of(task)
        able = able[(used[able] < chosen.shape[1]) & ~(chosen[able, :own] == task).any(axis=1)]
        order = np.argsort(instance.reach.distance_of(able, np.full(len(able), task)), kind="stable")
        able = able[order]
        enough = np.searchsorted(np.cumsum(instance.ability[able]), AMPLE * fair[task] - near_ability[task]) + 1
        chosen[able[:enough], used[able[:enough]]] = task
        used[able[:enough]] += 1
    spare = np.arange(chosen.shape[1])[None] >= used[:, None]
    for column in range(own, chosen.shape[1]):  # near tasks that were kept may have been added as scarce ones
        twice = (chosen[:, :column] == chosen[:, column : column + 1]).any(axis=1) & spare[:, column]
        chosen[twice, column] = -1


def _include(chosen: Ints, wanted: Ints, column: Ints) -> None:
    """Put each agent's wanted task in its column where it is not among the candidates."""
    absent = np.flatnonzero((wanted != IDLE) & ~(chosen == wanted[:, None]).any(axis=1))
    chosen[absent, column[absent]] = wanted[absent]
