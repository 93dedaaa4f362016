"""Greedy for a million agents: each finds the worst-served task within its reach in a tree over the tasks.

An agent visits a node only if its bounding box is within range and the node's worst-served task is served worse than
the best candidate so far; if that task is within reach, the rest of the node is skipped.
"""

from copy import copy
from typing import NamedTuple, TypedDict

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import (
    Floats,
    Indices,
    Tasks,
    Tree,
    build_tree,
    is_worse,
    update_all,
    update_path,
)
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems import Instance
from alloc.problems.distances.reach import TOLERANCE, Reach

MARGIN = 1 - 1e-9
"""Factor on the distance to a box, against rounding errors."""

STACK_SIZE = 64
"""Maximum number of pending nodes of a depth-first search of the binary tree."""


class Agents(NamedTuple):
    """The agents, and the limits of their origins as in `Reach`.

    Attributes
    ----------
    origin : ndarray of int, shape (n,)
    ability : ndarray, shape (n,)
    horizon : ndarray, shape (n,)
        Distance below which an agent arrives in time to contribute.
    task : ndarray of int, shape (n,)
        Task of each agent, -1 for none; changed in place.
    position : ndarray, shape (origins, 3)
    longest_distance, battery, radius : ndarray, shape (origins,)
        Limits with tolerance, and the distance beyond which no task is within reach.
    list_of : ndarray of int, shape (origins,)
        List of tasks of each origin, -1 for all tasks.
    list_begin, listed_task : ndarray of int
        Lists of tasks as a compressed sparse row.
    listed_distance : ndarray
        Distances of the listed tasks, which are all within reach; empty if coordinates determine distances.
    energy_per_distance : float
    """

    origin: Indices
    ability: Floats
    horizon: Floats
    task: Indices
    position: Floats
    longest_distance: Floats
    battery: Floats
    radius: Floats
    list_of: Indices
    list_begin: Indices
    listed_task: Indices
    listed_distance: Floats
    energy_per_distance: float


class TreeGreedy:
    """The greedy allocation, agent by agent, with ranges, batteries, task lists and travel times.

    Parameters
    ----------
    instance : Instance
        With at least one task that has workload.
    horizon : float
        Hour before which an agent must arrive at its task to contribute, if there are travel times.
    """

    def __init__(self, instance: Instance, horizon: float) -> None:
        reach, work = instance.reach, instance.workload
        by_size = np.argsort(-work, kind="stable")
        rank = np.empty(instance.m, dtype=np.intp)
        rank[by_size] = np.arange(instance.m)
        position = reach.goal
        self._tree = build_tree(position, np.sort(by_size[work[by_size] > 0]))
        self._tasks = Tasks(position, work, rank, np.zeros(instance.m), np.zeros(instance.m))
        update_all(self._tree, self._tasks)
        self._agents = idle_agents(instance, horizon)

    @property
    def task(self) -> Indices:
        """Task of each agent so far, -1 for none, shape (n,)."""
        return self._agents.task

    def assign(self, agents: Indices) -> None:
        """Assign each of `agents`, in this order, to the worst-served task within its reach."""
        _assign(agents, self._tree, self._tasks, self._agents)

    def clone(self) -> "TreeGreedy":
        """Return a copy for other agents, with the group abilities so far, which shares the array `task`."""
        clone = copy(self)
        clone._tree = self._tree._replace(worst=self._tree.worst.copy())
        clone._tasks = self._tasks._replace(
            group_ability=self._tasks.group_ability.copy(), coverage=self._tasks.coverage.copy()
        )
        return clone

    def join(self, clones: "list[TreeGreedy]") -> None:
        """Add the group abilities of clones, which were made before this object had agents and have none in common."""
        for clone in clones:
            self._tasks.group_ability[:] += clone._tasks.group_ability
        self._tasks.coverage[:] = self._tasks.group_ability / np.where(
            self._tasks.workload > 0, self._tasks.workload, 1
        )
        update_all(self._tree, self._tasks)


def idle_agents(instance: Instance, horizon: float) -> Agents:
    """Return the agents of an instance without tasks; see `TreeGreedy`."""
    reach = instance.reach
    return Agents(
        origin=reach.origin,
        ability=instance.ability,
        horizon=horizon * instance.speed,
        task=np.full(instance.n, -1, dtype=np.intp),
        position=reach.place,
        longest_distance=reach.communication_range + TOLERANCE,
        battery=reach.battery + TOLERANCE,
        radius=reach.radius,
        **_lists(reach),
        energy_per_distance=float(reach.energy_per_distance),
    )


class _Lists(TypedDict):
    """Fields of `Agents` on lists of tasks."""

    list_of: Indices
    list_begin: Indices
    listed_task: Indices
    listed_distance: Floats


def _lists(reach: Reach) -> _Lists:
    """Return the lists of tasks; without distances by coordinates, each origin lists all tasks within reach."""
    if reach.is_plain:
        return _Lists(
            list_of=reach.list_of,
            list_begin=np.concatenate([[0], np.cumsum([len(tasks) for tasks in reach.lists])]).astype(np.intp),
            listed_task=np.concatenate([np.zeros(0, dtype=np.intp), *reach.lists]),
            listed_distance=np.zeros(0),
        )
    near = reach.neighbours
    assert near is not None, "an instance with too many pairs is refused"
    return _Lists(
        list_of=np.arange(len(reach.place)),
        list_begin=near.first.astype(np.intp),
        listed_task=near.task.astype(np.intp),
        listed_distance=near.distance,
    )


def compile_loops() -> None:
    """Compile the loops, or load them from the cache."""
    TreeGreedy(Instance(ability=[1.0], workload=[1.0]), 1.0).assign(np.zeros(1, dtype=np.intp))


@compiled
def _assign(chosen: Indices, tree: Tree, tasks: Tasks, agents: Agents) -> None:
    stack = np.empty(STACK_SIZE, dtype=np.intp)
    for agent in chosen:
        if agents.list_of[agents.origin[agent]] >= 0:
            best, distance = _worst_of_list(agent, tasks, agents)
        else:
            best, distance = _worst_in_tree(agent, tree, tasks, agents, stack)
        if best < 0:
            continue
        agents.task[agent] = best
        tasks.group_ability[best] += agents.ability[agent] * (1.0 - distance / agents.horizon[agent])
        tasks.coverage[best] = tasks.group_ability[best] / tasks.workload[best]
        update_path(best, tree, tasks)


@inlined
def _worst_of_list(agent: int, tasks: Tasks, agents: Agents) -> tuple[int, float]:
    """Return the worst-served task within reach on the agent's list, and its distance; -1 if there is none."""
    origin = agents.origin[agent]
    longest, battery, horizon = agents.longest_distance[origin], agents.battery[origin], agents.horizon[agent]
    rate = agents.energy_per_distance
    number = agents.list_of[origin]
    best, best_distance = -1, 0.0
    for entry in range(agents.list_begin[number], agents.list_begin[number + 1]):
        j = agents.listed_task[entry]
        if tasks.workload[j] <= 0 or (best >= 0 and not is_worse(j, best, tasks.coverage, tasks.rank)):
            continue
        if agents.listed_distance.shape[0] > 0:
            if agents.listed_distance[entry] < horizon:
                best, best_distance = j, agents.listed_distance[entry]
            continue
        distance = straight_distance(agents.position[origin], tasks.position[j])
        if is_reachable(distance, longest, battery, rate, horizon):
            best, best_distance = j, distance
    return best, best_distance


@inlined
def _worst_in_tree(agent: int, tree: Tree, tasks: Tasks, agents: Agents, stack: Indices) -> tuple[int, float]:
    """Return the worst-served task within reach, and its distance; -1 if there is none."""
    begin, end, low, high, order, worst = tree.begin, tree.end, tree.low, tree.high, tree.order, tree.worst
    positions, coverage, rank = tasks.position, tasks.coverage, tasks.rank
    origin = agents.origin[agent]
    longest, battery, horizon = agents.longest_distance[origin], agents.battery[origin], agents.horizon[agent]
    rate = agents.energy_per_distance
    position = agents.position[origin]
    is_unknown = np.isnan(position[0])
    limit = min(agents.radius[origin], horizon)
    best, best_distance = -1, 0.0
    size, stack[0] = 1, 0
    while size > 0:
        size -= 1
        node = stack[size]
        j = worst[node]
        if best >= 0 and not is_worse(j, best, coverage, rank):
            continue
        if not is_unknown and _is_beyond(position, low[node], high[node], limit):
            continue
        distance = straight_distance(position, positions[j])
        if is_reachable(distance, longest, battery, rate, horizon):
            best, best_distance = j, distance
        elif 2 * node + 2 < len(begin):
            left, right = 2 * node + 1, 2 * node + 2
            if is_worse(worst[left], worst[right], coverage, rank):
                left, right = right, left
            stack[size], stack[size + 1] = left, right  # the worse-served child is visited first
            size += 2
        else:
            for entry in range(begin[node], end[node]):
                j = order[entry]
                if best >= 0 and not is_worse(j, best, coverage, rank):
                    continue
                distance = straight_distance(position, positions[j])
                if is_reachable(distance, longest, battery, rate, horizon):
                    best, best_distance = j, distance
    return best, best_distance


@compiled
def is_reachable(distance: float, longest: float, battery: float, energy_per_distance: float, horizon: float) -> bool:
    """Return whether a task at that distance is within range, battery and horizon of an agent."""
    return bool(distance <= longest and energy_per_distance * distance <= battery and distance < horizon)


@compiled
def straight_distance(one: Floats, other: Floats) -> float:
    """Return the same distance as `alloc.problems.distances.metric`, bit for bit."""
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    distance = float(np.sqrt(x * x + y * y + z * z))
    return 0.0 if np.isnan(distance) else distance


@compiled
def _is_beyond(position: Floats, low: Floats, high: Floats, limit: float) -> bool:
    """Return whether the box is farther away than `limit`."""
    total = 0.0
    for axis in range(3):
        step = max(0.0, low[axis] - position[axis], position[axis] - high[axis])
        total += step * step
    return bool(np.sqrt(total) * MARGIN > limit)
