"""Agents of equal ability exchange tasks so that they fly less; who does how much work stays as it is."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from alloc.problems import IDLE, Instance

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


def fly_less(instance: Instance, task: Indices, stop: Callable[[], bool]) -> Indices:
    """Give agents of equal ability each other's tasks, the near ones to the near ones.

    Agents and tasks are halved together along the widest side of the tasks' box, again and again, until one of each is
    left: a matching of n agents in O(n log² n). For instances in which everyone reaches everything at once.

    Parameters
    ----------
    task : ndarray of int, shape (n,)
        Task of each agent, -1 for idle.
    stop : callable
        Asked before each halving whether time is up; what is not halved by then is matched as it stands.

    Returns
    -------
    ndarray of int, shape (n,)
        Not farther in all than `task`.
    """
    start, goal = instance.start_position, instance.task_position
    movable = (task != IDLE) & ~np.isnan(start[:, 0])
    movable &= ~np.isnan(goal[task, 0])
    agents = np.flatnonzero(movable)
    agents = agents[np.argsort(instance.ability[agents], kind="stable")]
    if not len(agents):
        return task
    ability = instance.ability[agents]
    bounds = np.flatnonzero(np.concatenate([[True], ability[1:] != ability[:-1], [True]]))
    first, second = _halve(start[agents], goal[task[agents]], bounds, stop)
    changed = task.copy()
    changed[agents[first]] = task[agents[second]]
    distance = instance.reach.distance_of
    if distance(agents, changed[agents]).sum() < distance(agents, task[agents]).sum():
        return changed
    return task


def _halve(place: Floats, goal: Floats, bounds: Indices, stop: Callable[[], bool]) -> tuple[Indices, Indices]:
    """Match places with goals inside groups; return the number of a place, and of its goal, in the same order.

    Parameters
    ----------
    place, goal : ndarray, shape (k, 3)
    bounds : ndarray of int
        Where groups begin, and k: both sides of a group are ``bounds[i]:bounds[i + 1]``.
    """
    k = len(place)
    first, second = np.arange(k), np.arange(k)
    rank = [_ranks(side) for side in (place, goal)]
    while (np.diff(bounds) > 1).any() and not stop():
        size = np.diff(bounds)
        spot = goal[second]
        side = np.maximum.reduceat(spot, bounds[:-1]) - np.minimum.reduceat(spot, bounds[:-1])
        axis, group = np.repeat(np.argmax(side, axis=1), size), np.repeat(np.arange(len(size)), size)
        first = first[np.argsort(group * k + rank[0][first, axis])]
        second = second[np.argsort(group * k + rank[1][second, axis])]
        middle = bounds[:-1] + size // 2
        bounds = np.unique(np.concatenate([bounds, middle]))
    return first, second


def _ranks(points: Floats) -> Indices:
    """Order of each point along each axis, shape (k, 3)."""
    rank = np.empty(points.shape, dtype=np.intp)
    for axis in range(points.shape[1]):
        rank[np.argsort(points[:, axis], kind="stable"), axis] = np.arange(len(points))
    return rank
