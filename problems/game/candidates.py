"""Candidates of each agent: all tasks, or the nearest ones if there are many."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

SCARCE_SHARE = 4
"""One in this many candidates of each agent is reserved for tasks that are near few agents."""

AMPLE = 3.0
"""Ratio of ability to need up to which a scarce task is added to the candidates of its nearest agents."""

CHUNK = 2_000_000
"""Number of pairs of agent and task processed together, to limit memory."""

Ints = NDArray[np.int64]


class Candidates(NamedTuple):
    """Candidates of n agents, the last of which is idle.

    Attributes
    ----------
    place : ndarray of int, shape (n, c)
        Task, or m for idle and for padding if fewer tasks are in reach.
    distance, cost : ndarray, shape (n, c)
        Distance and cost of the flight, see `Reach.costs`.
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
        Number of candidates besides idle, at least 1; None, or the number of tasks or more, for all tasks.
    plan : ndarray of int, shape (n,), or None
        Place of each agent that must be among its candidates.
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
    """Append idle to the candidates, which have shape (n, c - 1)."""
    n = len(task)
    away = np.column_stack([distance, np.zeros(n)])
    return Candidates(
        np.column_stack([task, np.full(n, idle)]),
        away,
        away if cost is distance else np.column_stack([cost, np.zeros(n)]),
        np.column_stack([legal, np.ones(n, dtype=bool)]),
    )


def _nearest(instance: Instance, near: int) -> Ints:
    """Return the nearest tasks in reach, followed by scarce ones (`_add_scarce`); -1 for none; shape (n, near)."""
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
    """Put tasks with too little ability nearby into the last columns of the agents nearest to them."""
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
    for column in range(own, chosen.shape[1]):  # scarce tasks may already be among the near ones
        twice = (chosen[:, :column] == chosen[:, column : column + 1]).any(axis=1) & spare[:, column]
        chosen[twice, column] = -1


def _include(chosen: Ints, wanted: Ints, column: Ints) -> None:
    """Put the wanted task of each agent into its column, unless it is already a candidate."""
    absent = np.flatnonzero((wanted != IDLE) & ~(chosen == wanted[:, None]).any(axis=1))
    chosen[absent, column[absent]] = wanted[absent]
