"""Greedy by a tree over the tasks, for a million agents: each looks at few tasks, whatever its range.

A node of the tree knows the box around its tasks, and which of them is served worst. An agent descends into a node
only if the box is within its range and its worst-served task is served worse than the best found so far; where that
task is within reach, no other in the node is looked at.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems import Instance
from alloc.problems.distances.reach import TOLERANCE

LEAF = 8
"""Tasks in a leaf, at the most."""

MARGIN = 1 - 1e-9
"""Factor on the distance of a box, for what rounding may have added to it."""

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Tree:
    """A complete binary tree over tasks; the children of node k are 2 k + 1 and 2 k + 2.

    Attributes
    ----------
    begin, end : ndarray of int, shape (nodes,)
        The tasks of each node are ``order[begin:end]``.
    low, high : ndarray, shape (nodes, 3)
        Box around them; infinite where one of them has no place.
    order : ndarray of int, shape (tasks,)
    leaf : ndarray of int, shape (m,)
        Leaf of each task, -1 for tasks that are not in the tree.
    """

    begin: Indices
    end: Indices
    low: Floats
    high: Floats
    order: Indices
    leaf: Indices


def build_tree(place: Floats, tasks: Indices) -> Tree:
    """Halve `tasks` along the widest side of their box, again and again.

    Parameters
    ----------
    place : ndarray, shape (m, 3)
        Where the tasks are; NaN where unknown.
    tasks : ndarray of int
        Those to be in the tree; at least one.
    """
    depth = max(0, int(np.ceil(np.log2(len(tasks) / LEAF))))
    nodes = 2 ** (depth + 1) - 1
    begin, end = np.zeros(nodes, dtype=np.intp), np.full(nodes, len(tasks), dtype=np.intp)
    low, high = np.empty((nodes, 3)), np.empty((nodes, 3))
    order, leaf = tasks.copy(), np.full(len(place), -1, dtype=np.intp)
    for node in range(nodes):
        part = order[begin[node] : end[node]]
        where = place[part]
        unknown = np.isnan(where).any()
        low[node] = -np.inf if unknown else where.min(axis=0)
        high[node] = np.inf if unknown else where.max(axis=0)
        if 2 * node + 2 >= nodes:
            leaf[part] = node
            continue
        axis = 0 if unknown else int(np.argmax(high[node] - low[node]))
        order[begin[node] : end[node]] = part[np.argsort(where[:, axis], kind="stable")]
        middle = (begin[node] + end[node]) // 2
        begin[2 * node + 1], end[2 * node + 1] = begin[node], middle
        begin[2 * node + 2], end[2 * node + 2] = middle, end[node]
    return Tree(begin, end, low, high, order, leaf)


class TreeGreedy:
    """The greedy allocation, agent by agent, for reaches of every kind.

    Parameters
    ----------
    instance : Instance
        With at least one task that has workload.
    horizon : float
        Hour by which an agent must be at its task to be of use there, where travel takes time.

    Attributes
    ----------
    task : ndarray of int, shape (n,)
        Task of each agent so far, -1 for none.
    """

    def __init__(self, instance: Instance, horizon: float) -> None:
        reach, work = instance.reach, instance.workload
        by_size = np.argsort(-work, kind="stable")
        rank = np.empty(instance.m, dtype=np.intp)
        rank[by_size] = np.arange(instance.m)
        tree = build_tree(reach.goal, np.sort(by_size[work[by_size] > 0]))
        self.task = np.full(instance.n, -1, dtype=np.intp)
        first = np.concatenate([[0], np.cumsum([len(tasks) for tasks in reach.lists])]).astype(np.intp)
        listed = np.concatenate([np.zeros(0, dtype=np.intp), *reach.lists])
        worst = np.zeros(len(tree.begin), dtype=np.intp)
        ratio = np.zeros(instance.m)
        _fill(tree.begin, tree.end, tree.order, ratio, rank, worst)
        self._tree = (tree.begin, tree.end, tree.low, tree.high, tree.order, tree.leaf, worst)
        self._tasks = (reach.goal, work, rank, np.zeros(instance.m), ratio)
        self._agents = (reach.origin, instance.ability, horizon * instance.speed, self.task)
        limits = (reach.communication_range + TOLERANCE, reach.battery + TOLERANCE, reach.radius)
        self._origins = (reach.place, *limits, reach.list_of, first, listed)
        self._scale = (1.0, float(reach.energy_per_distance))

    def place(self, agents: Indices) -> None:
        """Give each of `agents`, in this order, the task that is worst served within its reach."""
        _place(agents, self._tree, self._tasks, self._agents, self._origins, self._scale)


@compiled
def _is_worse(one: int, other: int, ratio: Floats, rank: Indices) -> bool:
    """Whether task `one` is served worse than `other`, or as badly and comes first."""
    if ratio[one] == ratio[other]:
        return bool(rank[one] < rank[other])
    return bool(ratio[one] < ratio[other])


@compiled
def _find_worst(
    node: int, begin: Indices, end: Indices, order: Indices, ratio: Floats, rank: Indices, worst: Indices
) -> None:
    """Set the worst-served task of `node`, whose children know theirs."""
    if 2 * node + 2 < len(begin):
        left, right = worst[2 * node + 1], worst[2 * node + 2]
        worst[node] = left if _is_worse(left, right, ratio, rank) else right
        return
    best = order[begin[node]]
    for entry in range(begin[node] + 1, end[node]):
        if _is_worse(order[entry], best, ratio, rank):
            best = order[entry]
    worst[node] = best


@compiled
def _fill(begin: Indices, end: Indices, order: Indices, ratio: Floats, rank: Indices, worst: Indices) -> None:
    for node in range(len(begin) - 1, -1, -1):
        _find_worst(node, begin, end, order, ratio, rank, worst)


@compiled
def _distance(place: Floats, goal: Floats, unit: float) -> float:
    """As in `alloc.problems.distances.metric`, to the last bit."""
    x, y, z = place[0] - goal[0], place[1] - goal[1], place[2] - goal[2]
    away = float(np.sqrt(x * x + y * y + z * z))
    if np.isnan(away):
        return 0.0
    return away if unit == 1.0 else min(away * unit, 1.7976931348623157e308)


@compiled
def _is_far(place: Floats, low: Floats, high: Floats, limit: float) -> bool:
    """Whether the box is beyond `limit`."""
    total = 0.0
    for axis in range(3):
        step = max(0.0, low[axis] - place[axis], place[axis] - high[axis])
        total += step * step
    return bool(np.sqrt(total) * MARGIN > limit)


@compiled
def _place(
    agents: Indices,
    tree: tuple[Indices, Indices, Floats, Floats, Indices, Indices, Indices],
    tasks: tuple[Floats, Floats, Indices, Floats, Floats],
    figures: tuple[Indices, Floats, Floats, Indices],
    origins: tuple[Floats, Floats, Floats, Floats, Indices, Indices, Indices],
    scale: tuple[float, float],
) -> None:
    begin, end, low, high, order, leaf, worst = tree
    goal, work, rank, group, ratio = tasks
    origin, ability, horizon, task = figures
    places, ranges, batteries, radius, list_of, first, listed = origins
    unit, energy = scale
    stack = np.empty(64, dtype=np.intp)
    for agent in agents:
        home = origin[agent]
        place = places[home]
        lost = np.isnan(place[0])
        limit = min(radius[home], horizon[agent]) / unit
        best, best_away = -1, 0.0
        # lists are gone through; else a stack of nodes
        number = list_of[home]
        if number >= 0:
            for entry in range(first[number], first[number + 1]):
                j = listed[entry]
                if work[j] <= 0 or (best >= 0 and not _is_worse(j, best, ratio, rank)):
                    continue
                away = _distance(place, goal[j], unit)
                if away <= ranges[home] and energy * away <= batteries[home] and away < horizon[agent]:
                    best, best_away = j, away
        else:
            size, stack[0] = 1, 0
            while size > 0:
                size -= 1
                node = stack[size]
                j = worst[node]
                if best >= 0 and not _is_worse(j, best, ratio, rank):
                    continue
                if not lost and _is_far(place, low[node], high[node], limit):
                    continue
                away = _distance(place, goal[j], unit)
                if away <= ranges[home] and energy * away <= batteries[home] and away < horizon[agent]:
                    best, best_away = j, away
                elif 2 * node + 2 < len(begin):
                    left, right = 2 * node + 1, 2 * node + 2
                    if _is_worse(worst[left], worst[right], ratio, rank):
                        left, right = right, left
                    stack[size], stack[size + 1] = left, right  # the worse served is looked at first
                    size += 2
                else:
                    for entry in range(begin[node], end[node]):
                        j = order[entry]
                        if best >= 0 and not _is_worse(j, best, ratio, rank):
                            continue
                        away = _distance(place, goal[j], unit)
                        if away <= ranges[home] and energy * away <= batteries[home] and away < horizon[agent]:
                            best, best_away = j, away
        if best < 0:
            continue
        task[agent] = best
        group[best] += ability[agent] * (1.0 - best_away / horizon[agent])
        ratio[best] = group[best] / work[best]
        node = leaf[best]
        _find_worst(node, begin, end, order, ratio, rank, worst)
        while node > 0:
            node = (node - 1) // 2
            _find_worst(node, begin, end, order, ratio, rank, worst)
