"""Swaps of tasks between agents of equal ability, which reduce the distance and leave group abilities unchanged."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from alloc.problems import IDLE, Instance

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


def reduce_distance(instance: Instance, task: Indices, stop: Callable[[], bool]) -> Indices:
    """Reassign agents of equal ability among their tasks, so that agents get near tasks.

    Agents and tasks are bisected together along the widest side of the tasks' bounding box, recursively, until one of
    each is left: a matching of n agents in O(n log² n). For instances without travel times in which every agent can
    reach every task.

    Parameters
    ----------
    instance : Instance
    task : ndarray of int, shape (n,)
        Task of each agent, -1 for idle.
    stop : callable
        Checked before each bisection; when it returns true, the rest is matched in the present order.

    Returns
    -------
    ndarray of int, shape (n,)
        The new tasks, with a total cost no larger than that of `task`.
    """
    start, goal = instance.reach.place[instance.reach.origin], instance.reach.goal
    movable = (task != IDLE) & ~np.isnan(start[:, 0])
    movable &= ~np.isnan(goal[task, 0])
    agents = np.flatnonzero(movable)
    agents = agents[np.argsort(instance.ability[agents], kind="stable")]
    if not len(agents):
        return task
    ability = instance.ability[agents]
    bounds = np.flatnonzero(np.concatenate([[True], ability[1:] != ability[:-1], [True]]))
    first, second = _match_by_bisection(start[agents], goal[task[agents]], bounds, stop)
    changed = task.copy()
    changed[agents[first]] = task[agents[second]]
    cost = instance.reach.cost_of
    if cost(agents, changed[agents]).sum() < cost(agents, task[agents]).sum():
        return changed
    return task


def _match_by_bisection(
    start: Floats, goal: Floats, bounds: Indices, stop: Callable[[], bool]
) -> tuple[Indices, Indices]:
    """Match starts with goals within groups; return the indices of matched starts and goals, in the same order.

    Parameters
    ----------
    start, goal : ndarray, shape (k, 3)
    bounds : ndarray of int
        Indices where groups begin, and k: starts and goals of group i are ``bounds[i]:bounds[i + 1]``.
    stop : callable
    """
    k = len(start)
    first, second = np.arange(k), np.arange(k)
    rank = [_ranks(points) for points in (start, goal)]
    while (np.diff(bounds) > 1).any() and not stop():
        size = np.diff(bounds)
        points = goal[second]
        extent = np.maximum.reduceat(points, bounds[:-1]) - np.minimum.reduceat(points, bounds[:-1])
        axis, group = np.repeat(np.argmax(extent, axis=1), size), np.repeat(np.arange(len(size)), size)
        first = first[np.argsort(group * k + rank[0][first, axis])]
        second = second[np.argsort(group * k + rank[1][second, axis])]
        middle = bounds[:-1] + size // 2
        bounds = np.unique(np.concatenate([bounds, middle]))
    return first, second


def _ranks(points: Floats) -> Indices:
    """Return the rank of each point along each axis, shape (k, 3)."""
    rank = np.empty(points.shape, dtype=np.intp)
    for axis in range(points.shape[1]):
        rank[np.argsort(points[:, axis], kind="stable"), axis] = np.arange(len(points))
    return rank
