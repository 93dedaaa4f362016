"""Repair of allocations, to serve more tasks by moving few agents: a bipartite matching of tasks with agents."""

from collections import deque
from collections.abc import Iterator
from itertools import compress

import numpy as np

from alloc.problems.allocation import Allocation, require_fit
from alloc.problems.arguments import of_type
from alloc.problems.distances.neighbours import estimated_pairs
from alloc.problems.instance import Instance, IntArray
from alloc.problems.matching.clock import EVALUATED_PER_SECOND, GATHERED_PER_SECOND, Clock, unlimited
from alloc.problems.vocabulary import IDLE

SPENT = -1
"""Mark of agents visited by a failed search, which cannot be on any later path."""

NEARBY = 64
"""Number of nearest origins of a task that are tried first if there are many."""

NEXT = 8
"""Number of these origins that suffice for most tasks."""

CHUNK = 16_384
"""Number of tasks processed between two checks of the clock, which take about 0.1 s."""

MANY = 50_000_000
"""Number of pairs of agent, or of origin, and unserved task from which they are too many to enumerate."""


class _Matching:
    """Matching of one agent per served task, extended by augmenting paths (Berge 1957, doi:10.1073/pnas.43.9.842)."""

    def __init__(self, instance: Instance, task_of_agent: IntArray, unserved: int, time_left: Clock) -> None:
        self.reach, self.time_left = instance.reach, time_left
        self.task_of_agent = task_of_agent.copy()
        self.keeper = np.full(instance.m, IDLE, dtype=np.intp)
        working = np.flatnonzero(task_of_agent != IDLE)
        self.keeper[task_of_agent[working]] = working
        self.kept_task = np.full(instance.n, IDLE, dtype=np.intp)
        held = np.flatnonzero(self.keeper != IDLE)
        self.kept_task[self.keeper[held]] = held
        self.met = np.zeros(instance.n, dtype=np.intp)  # the last search that visited each agent
        self.search = 0
        reach = self.reach
        self._mask_by_task = np.ascontiguousarray(reach.mask.T) if reach.has_table else None
        many = not reach.has_table and unserved * len(reach.place) > MANY and not reach.is_complete
        many = many and (limit := GATHERED_PER_SECOND * time_left()) > 0 and estimated_pairs(reach) <= limit
        near = reach.neighbours if many else None
        self._rows = None if near is None else near.by_task(instance.m)

    def serve(self, task: int) -> IntArray | None:
        """Serve `task` along a shortest augmenting path; return None, or if impossible, the tasks that compete with it.

        If time runs out, these are incomplete.
        """
        came_from: dict[int, tuple[int, int]] = {}  # task -> (task that takes over its agent, that agent)
        self.search += 1
        queue, seen = deque([task]), {task}
        while queue:
            if self.time_left() <= 0:
                return np.array(sorted(seen), dtype=np.intp)
            wanting = queue.popleft()
            able = self._able(wanting)
            able = able[(self.met[able] != self.search) & (self.met[able] != SPENT)]
            free = able[self.kept_task[able] == IDLE]
            if len(free):
                self._augment(wanting, self._cheapest(free, wanting), came_from)
                return None
            self.met[able] = self.search
            for agent in able.tolist():
                held = int(self.kept_task[agent])
                if held not in seen:
                    seen.add(held)
                    came_from[held] = (wanting, agent)
                    queue.append(held)
        self.met[self.met == self.search] = SPENT
        return np.array(sorted(seen), dtype=np.intp)

    def _able(self, task: int) -> IntArray:
        """Return the agents that can take `task`; from precomputed rows if there are many tasks."""
        if self._mask_by_task is not None:
            return np.flatnonzero(self._mask_by_task[task][self.reach.origin])
        if self._rows is None:
            return self.reach.agents_of(task)
        (first, origins), (begin, agents) = self._rows, self.reach.agents_by_origin
        near = origins[first[task] : first[task + 1]]
        sizes = begin[near + 1] - begin[near]
        offsets = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        able: IntArray = agents[np.repeat(begin[near], sizes) + offsets]
        return able

    def _cheapest(self, agents: IntArray, task: int) -> int:
        """Return the nearest idle agent or, if none is idle, the nearest agent."""
        idle = agents[self.task_of_agent[agents] == IDLE]
        choice = idle if len(idle) else agents
        distance = self.reach.distance_of(choice, np.full(len(choice), task))
        return int(choice[np.argmin(distance)])

    def _augment(self, task: int, agent: int, came_from: dict[int, tuple[int, int]]) -> None:
        while True:
            self.keeper[task], self.kept_task[agent], self.task_of_agent[agent] = agent, task, task
            if task not in came_from:
                return
            task, agent = came_from[task]


def needs_agent(instance: Instance) -> IntArray:
    """Return the tasks with workload, in ascending order."""
    return np.flatnonzero(of_type(instance, Instance, "instance").workload > 0)


def _most_urgent_first(instance: Instance) -> IntArray:
    """Return the tasks with workload, sorted by descending priority."""
    tasks = needs_agent(instance)
    return tasks[np.argsort(-instance.priority[tasks], kind="stable")]


def only_allowed(instance: Instance, allocation: Allocation) -> Allocation:
    """Return `allocation` with those agents idle that are assigned to tasks that they cannot take.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation

    Returns
    -------
    Allocation
    """
    return Allocation(_allowed(instance, allocation))


def _allowed(instance: Instance, allocation: Allocation) -> IntArray:
    """Return the task of each agent, or `IDLE` if it cannot take its task in `allocation`."""
    task = require_fit(instance, allocation).copy()
    working = np.flatnonzero(task != IDLE)
    task[working[~instance.reach.allows(working, task[working])]] = IDLE
    return task


def serve_all(instance: Instance, allocation: Allocation, time_left: Clock = unlimited) -> Allocation:
    """Return a changed allocation in which as few tasks as possible are unserved, serving high priorities first.

    Agents that cannot take their tasks become idle. Served tasks stay served. Agents are moved only along shortest
    augmenting paths, which end at an idle agent if possible, or else at the nearest one. If `time_left` runs out, the
    remaining tasks may stay unserved.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation
    time_left : callable
        Returns the seconds left; by default no limit.

    Returns
    -------
    Allocation
    """
    task = _allowed(instance, allocation)
    served = np.zeros(instance.m, dtype=bool)
    served[task[task != IDLE]] = True
    unserved = [j for j in _most_urgent_first(instance).tolist() if not served[j]]
    if not unserved:
        return Allocation(task)
    if instance.reach.is_complete and instance.n * len(unserved) > MANY:
        return Allocation(_serve_by_anyone(instance, task, unserved))
    pairs = len(instance.reach.place) * len(unserved)
    if not instance.reach.has_table and (pairs > MANY or pairs > EVALUATED_PER_SECOND * time_left()):
        task, unserved = _serve_nearby(instance, task, unserved, time_left)
    matching = _start(instance, task, len(unserved), time_left)
    for j in unserved:
        if time_left() <= 0:
            break
        matching.serve(j)
    return Allocation(matching.task_of_agent)


def _serve_by_anyone(instance: Instance, task_of_agent: IntArray, unserved: list[int]) -> IntArray:
    """Serve tasks if all agents can take all tasks: by idle agents first, regardless of distance."""
    keeper = np.full(instance.m, IDLE, dtype=np.intp)
    working = np.flatnonzero(task_of_agent != IDLE)
    keeper[task_of_agent[working]] = working
    kept = keeper[(keeper != IDLE) & (instance.workload > 0)]
    task_of_agent, busy = task_of_agent.copy(), (task_of_agent != IDLE).astype(np.int8)
    busy[kept] = 2
    free = np.argsort(busy, kind="stable")[: int((busy < 2).sum())][: len(unserved)]
    task_of_agent[free] = unserved[: len(free)]
    return task_of_agent


def _serve_nearby(
    instance: Instance, task_of_agent: IntArray, unserved: list[int], time_left: Clock
) -> tuple[IntArray, list[int]]:
    """Serve tasks by idle agents from the `NEARBY` nearest origins; return the remaining tasks."""
    from scipy.spatial import cKDTree

    reach, task_of_agent = instance.reach, task_of_agent.copy()
    by_origin = reach.agents_by_origin[1]
    idle = by_origin[task_of_agent[by_origin] == IDLE]
    bounds = np.searchsorted(reach.origin[idle], np.arange(len(reach.place) + 1))
    first, end = bounds[:-1], bounds[1:]
    origins = np.flatnonzero((first < end) & ~np.isnan(reach.place[:, 0]))
    goals = np.array(unserved)[~np.isnan(reach.goal[unserved, 0])]
    if not len(origins) or not len(goals):
        return task_of_agent, unserved
    tree, free, last, served = cKDTree(reach.place[origins]), first.tolist(), end.tolist(), set()

    def nearest(some: IntArray, count: int) -> Iterator[list[int]]:
        """Yield the origins within reach among the `count` nearest of each task, the nearest first."""
        count = min(count, len(origins))
        near = origins[tree.query(reach.goal[some], k=count)[1].reshape(len(some), count)]
        within = reach.is_within(near, some[:, None], reach.distances_between(near, some[:, None]))
        return (list(compress(*row)) for row in zip(near.tolist(), within.tolist(), strict=True))

    for begin in range(0, len(goals), CHUNK):
        if begin and time_left() <= 0:
            break
        some = goals[begin : begin + CHUNK]
        for j, near in zip(some, nearest(some, NEXT), strict=True):
            able = next((origin for origin in near if free[origin] < last[origin]), IDLE)
            if able == IDLE:
                further = next(nearest(np.array([j]), NEARBY))
                able = next((origin for origin in further if free[origin] < last[origin]), IDLE)
            if able != IDLE:
                task_of_agent[idle[free[able]]] = j
                free[able] += 1
                served.add(int(j))
    return task_of_agent, [j for j in unserved if j not in served]


def _start(instance: Instance, task_of_agent: IntArray, unserved: int, time_left: Clock = unlimited) -> _Matching:
    """Return a matching in which tasks without workload have no agent; `unserved` is the number of tasks to serve."""
    matching = _Matching(instance, task_of_agent, unserved, time_left)
    for j in np.flatnonzero(instance.workload == 0).tolist():
        if matching.keeper[j] != IDLE:
            matching.kept_task[matching.keeper[j]] = IDLE
            matching.keeper[j] = IDLE
    return matching


def serve_in_turn(instance: Instance, tasks: IntArray) -> Iterator[IntArray | None]:
    """Serve tasks one by one, keeping earlier ones served; yield None or, if impossible, the competing tasks."""
    matching = _start(instance, np.full(instance.n, IDLE, dtype=np.intp), len(tasks))
    for j in tasks.tolist():
        yield matching.serve(j)
