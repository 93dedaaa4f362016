"""Which tasks an agent bids for: all of them, or the near ones where there are many."""

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

SHARED = 4
"""Candidates of each agent that are kept for tasks which few have near, as a share: one in so many."""

AMPLE = 3.0
"""Supply over need from the nearest agents up to which a task is added to their candidates."""

CHUNK = 2_000_000
"""Pairs looked at at once, to bound the memory."""

Layout = tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]


def near_tasks(instance: Instance, near: int | None, plan: NDArray[np.int64] | None) -> Layout:
    """Return place, distance and legality of each agent's candidates, each of shape (n, c); the last is idleness.

    Parameters
    ----------
    near : int or None
        Candidates besides idleness, at least 1; None, or as many as there are tasks, for all tasks.
    plan : ndarray of int, shape (n,), or None
        Places that must be among the candidates.
    """
    n, m = instance.n, instance.m
    if near is None or near >= m:
        distance, legal = instance.reach.rows(instance.reach.origin)
        goal = np.broadcast_to(np.arange(m + 1), (n, m + 1)).copy()
        return goal, np.column_stack([distance, np.zeros(n)]), np.column_stack([legal, np.ones(n, dtype=bool)])
    chosen = _nearest(instance, near)
    _include(chosen, instance.start_task, np.full(n, -1))
    if plan is not None:
        begins = (chosen[:, -1] == instance.start_task) & (near > 1)
        _include(chosen, plan, np.where(begins, -2, -1))
    agent = np.repeat(np.arange(n), near)
    known = chosen.ravel() >= 0
    task = np.where(known, chosen.ravel(), 0)
    distance = instance.reach.distance_of(agent, task).reshape(n, near)
    legal = (instance.reach.allows(agent, task) & known).reshape(n, near)
    goal = np.where(chosen < 0, m, chosen)
    return (
        np.column_stack([goal, np.full(n, m)]),
        np.column_stack([np.where(legal, distance, 0.0), np.zeros(n)]),
        np.column_stack([legal, np.ones(n, dtype=bool)]),
    )


def _nearest(instance: Instance, near: int) -> NDArray[np.int64]:
    """The nearest tasks in reach, and in the last columns tasks that lack near agents; -1 for none; shape (n, near)."""
    reach, m = instance.reach, instance.m
    own = near - near // SHARED
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


def _add_scarce(instance: Instance, chosen: NDArray[np.int64], own: int) -> None:
    """Put tasks that too little ability has near in place of the farthest candidates of the agents nearest to them."""
    n, m = instance.n, instance.m
    kept = chosen[:, :own]
    supply = np.bincount(kept[kept >= 0], np.repeat(instance.ability[:, None], own, axis=1)[kept >= 0], minlength=m)
    fair = instance.workload / max(instance.workload.sum(), 1e-300) * instance.ability.sum()
    used = np.full(n, own)
    for task in np.flatnonzero(supply < AMPLE * fair).tolist():
        able = instance.reach.agents_of(task)
        able = able[(used[able] < chosen.shape[1]) & ~(chosen[able, :own] == task).any(axis=1)]
        order = np.argsort(instance.reach.distance_of(able, np.full(len(able), task)), kind="stable")
        able = able[order]
        enough = np.searchsorted(np.cumsum(instance.ability[able]), AMPLE * fair[task] - supply[task]) + 1
        chosen[able[:enough], used[able[:enough]]] = task
        used[able[:enough]] += 1
    spare = np.arange(chosen.shape[1])[None] >= used[:, None]
    for column in range(own, chosen.shape[1]):  # near tasks that were kept may have been added as scarce ones
        twice = (chosen[:, :column] == chosen[:, column : column + 1]).any(axis=1) & spare[:, column]
        chosen[twice, column] = -1


def _include(chosen: NDArray[np.int64], wanted: NDArray[np.int64], column: NDArray[np.int64]) -> None:
    """Put each agent's wanted task in its column where it is not among the candidates."""
    missing = np.flatnonzero((wanted != IDLE) & ~(chosen == wanted[:, None]).any(axis=1))
    chosen[missing, column[missing]] = wanted[missing]
