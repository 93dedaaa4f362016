"""Pairs of agents and tasks that they can do alone: all of them, or a sample if there are too many."""

import sys

import numpy as np
from numpy.typing import NDArray

from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.matching.assignment import Pairs
from alloc.problems.matching.clock import EVALUATED_PER_SECOND, SAMPLED_PER_SECOND, Clock
from alloc.problems.matching.precedence import Precedence

BLOCK_OF_AGENTS = 64
"""Number of agents that share a sample of tasks, so that their distances are computed together."""

TASKS_PER_AGENT = 16
"""Number of tasks in a shared sample per agent; with fewer, agents would compete for the same tasks."""

LARGEST_BLOCK = 1 << 20
"""Maximum number of distances in memory at a time."""

MAX_PAIRS = 8_000_000
"""Maximum number of pairs of a sample."""

LOOKED_AT = 1_000
"""Number of tasks from which the share of those within reach is estimated."""

NEAREST = 32
"""Number of nearest tasks that a sample for the least energy also contains."""


def hours_alone(instance: Instance, agents: IntArray, tasks: IntArray, distance: FloatArray) -> FloatArray:
    """Return when each agent would finish its task alone, at the given `distance`; shape (k,)."""
    with np.errstate(over="ignore"):
        hours = instance.workload[tasks] / instance.ability[agents] + distance / instance.speed[agents]
        return np.minimum(hours, sys.float_info.max)


def bound_by_size(instance: Instance, agents: IntArray, tasks: IntArray) -> float:
    """Return a lower bound on the makespan of an assignment, by the smallest workloads and least able agents."""
    least = np.sort(instance.workload[tasks])[: len(agents)]
    return float((least / np.sort(instance.ability[agents])).max())


def all_pairs(
    instance: Instance,
    agents: IntArray,
    tasks: IntArray,
    latest: float,
    time_left: Clock,
    *,
    by_cost: bool = False,
    precedence: Precedence | None = None,
) -> Pairs | None:
    """Return the k best pairs with `tasks` of each of k agents that finish by `latest`; None if time runs out.

    The best are the fastest, or the cheapest with `by_cost`. No more are needed, as an agent with k tasks always finds
    one that the other k - 1 agents do not take. Pairs with tasks that `precedence` requires are added, and pairs that
    it forbids are left out.
    """
    reach, wanted = instance.reach, np.zeros(instance.m, dtype=np.bool_)
    wanted[tasks] = True
    k, last = len(agents), last_equal(latest)
    first, parts = np.zeros(k + 1, dtype=np.intp), []
    for row, agent in enumerate(agents.tolist()):
        if time_left() <= 0:
            return None
        distance, mask = (table[0] for table in reach.rows(reach.origin[agent : agent + 1]))
        task = np.flatnonzero(mask & wanted)
        if precedence is not None:
            task = task[precedence.allows(np.full(len(task), row), task)]
        away = distance[task]
        time = hours_alone(instance, np.full(len(task), agent), task, away)
        keep = np.flatnonzero(time <= last)
        cost = reach.costs(np.full(len(task), reach.origin[agent]), task, away)
        required = 0 if precedence is None else int(precedence.required[task[keep]].sum())
        if len(keep) > k + required:
            key = (cost if by_cost else time)[keep]
            if required and precedence is not None:
                key[precedence.required[task[keep]]] = -1.0
            keep = np.sort(keep[np.argpartition(key, k + required - 1)[: k + required]])
        parts.append((task[keep], time[keep], cost[keep]))
        first[row + 1] = first[row] + len(keep)
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Pairs(first, columns[0], columns[1], columns[2])


def sampled_pairs(
    instance: Instance,
    agents: IntArray,
    tasks: IntArray,
    known: IntArray | None,
    seconds: float,
    time_left: Clock,
    *,
    latest: float = np.inf,
    by_cost: bool = False,
) -> tuple[Pairs, bool]:
    """Return a sample of pairs of `agents` with `tasks`, and whether it is as good as all pairs.

    Tasks are sampled in geometric strata of their workloads: equally many from each stratum, where each stratum is
    twice as large as the one before. For agents with a list, all tasks on it are used.

    Parameters
    ----------
    known : ndarray of int, shape (k,), optional
        A task of each agent, whose pair is included.
    seconds : float
        Approximate time limit, also for each matching of the pairs.
    latest : float
        Latest completion time of a pair.
    by_cost : bool
        Whether to prefer the cheapest pairs instead of the fastest.
    """
    found = _Found(instance, agents, latest, by_cost=by_cost)
    list_of = instance.reach.list_of[instance.reach.origin[agents]]
    _add_listed(found, list_of, tasks)
    free = np.flatnonzero(list_of < 0)
    free = free[np.argsort(instance.ability[agents[free]], kind="stable")]
    complete = _add_sampled(found, free, tasks, seconds, time_left)
    if by_cost and not complete and len(free):
        _add_nearest(found, free, tasks)
    if known is not None:
        found.add_pairs(np.arange(len(agents)), known)
    return found.pairs(), complete and not found.is_cut


def _add_listed(found: "_Found", list_of: IntArray, tasks: IntArray) -> None:
    """Add the pairs of agents with a list."""
    rows, lists = np.flatnonzero(list_of >= 0), found.instance.reach.lists
    if not len(rows):
        return
    wanted = np.zeros(found.instance.m, dtype=np.bool_)
    wanted[tasks] = True
    choices = [lists[number] for number in list_of[rows].tolist()]
    row, task = np.repeat(rows, list(map(len, choices))), np.concatenate(choices)
    found.add_pairs(row[wanted[task]], task[wanted[task]])


def _add_sampled(found: "_Found", rows: IntArray, tasks: IntArray, seconds: float, time_left: Clock) -> bool:
    """Add sampled pairs of the agents at `rows`, the least able first; return whether these are all pairs."""
    work, ability = found.instance.workload, found.instance.ability[found.agents]
    by_work = tasks[np.argsort(work[tasks], kind="stable")]
    rng, complete = np.random.default_rng(0), True
    each = seconds * EVALUATED_PER_SECOND / max(1, len(rows))
    if each < len(tasks):
        each = min(
            each, seconds * SAMPLED_PER_SECOND / max(1.0, len(rows) * _share_within_reach(found, rows, tasks, rng))
        )
    looked_at = min(len(tasks), max(1.0, each))
    size = int(max(1, min(BLOCK_OF_AGENTS, LARGEST_BLOCK // looked_at, looked_at // TASKS_PER_AGENT)))
    for begin in range(0, len(rows), size):
        if time_left() <= 0:
            return False
        block = rows[begin : begin + size]
        most = min(found.last * float(ability[block[-1]]), sys.float_info.max)
        some = by_work[: np.searchsorted(work[by_work], most, side="right")]
        if len(some) > each:
            complete, some = False, some[_of_every_size(len(some), int(each), rng)]
        found.add(block, some)
    return complete


def _share_within_reach(found: "_Found", rows: IntArray, tasks: IntArray, rng: np.random.Generator) -> float:
    """Return an estimate of the share of pairs within reach."""
    some = found.agents[rng.permutation(rows)[:BLOCK_OF_AGENTS]]
    reach = found.instance.reach
    _, mask = reach.block(reach.origin[some], rng.permutation(tasks)[:LOOKED_AT])
    return float(mask.mean()) if mask.size else 0.0


class _Found:
    """Accumulator of pairs, block by block."""

    def __init__(self, instance: Instance, agents: IntArray, latest: float, *, by_cost: bool) -> None:
        self.instance, self.agents = instance, agents
        self.last, self.by_cost = last_equal(latest), by_cost
        self.most = min(len(agents), max(NEAREST, MAX_PAIRS // len(agents)))
        self.is_cut = False
        none, nothing = np.zeros(0, dtype=np.intp), np.zeros(0)
        self.parts: list[tuple[IntArray, IntArray, FloatArray, FloatArray]] = [(none, none, nothing, nothing)]

    def add(self, rows: IntArray, tasks: IntArray) -> None:
        """Add the pairs of all agents at `rows` with all of `tasks`."""
        if not len(tasks):
            return
        distance, mask = self.instance.reach.block(self.instance.reach.origin[self.agents[rows]], tasks)
        row, column = np.nonzero(mask)
        self._keep(rows[row], tasks[column], distance[mask])

    def add_pairs(self, rows: IntArray, tasks: IntArray) -> None:
        """Add the pairs of agents at `rows` with their `tasks`, if within reach."""
        reach, origin = self.instance.reach, self.instance.reach.origin[self.agents[rows]]
        distance = reach.distances_between(origin, tasks)
        good = reach.is_within(origin, tasks, distance)
        self._keep(rows[good], tasks[good], distance[good])

    def _keep(self, row: IntArray, task: IntArray, distance: FloatArray) -> None:
        hours = hours_alone(self.instance, self.agents[row], task, distance)
        cost = self.instance.reach.costs(self.instance.reach.origin[self.agents[row]], task, distance)
        keep = np.flatnonzero(hours <= self.last)
        if np.bincount(row[keep]).max(initial=0) > self.most:
            best = _first_of_each(row[keep], (cost if self.by_cost else hours)[keep], self.most)
            keep, self.is_cut = keep[best], self.is_cut or self.most < len(self.agents)
        self.parts.append((row[keep], task[keep], hours[keep], cost[keep]))

    def pairs(self) -> Pairs:
        """Return the pairs without repetitions, grouped by agent."""
        row, task, hours, cost = (np.concatenate(column) for column in zip(*self.parts, strict=True))
        _, once = np.unique(row * self.instance.m + task, return_index=True)
        first = np.searchsorted(row[once], np.arange(len(self.agents) + 1))
        return Pairs(first, task[once], hours[once], cost[once])


def _first_of_each(row: IntArray, key: FloatArray, most: int) -> IntArray:
    """Return the indices of the `most` entries with the least keys of each row; `row` is ascending."""
    order = np.lexsort((key, row))
    length = np.bincount(row)
    begin = np.cumsum(length) - length
    kept: IntArray = order[np.arange(len(row)) - begin[row[order]] < most]
    return kept


def _of_every_size(count: int, each: int, rng: np.random.Generator) -> IntArray:
    """Return about `each` of `count` indices: equally many from consecutive ranges that double in size."""
    width = max(1, each)
    while width > 1 and width * (1 + int(np.ceil(np.log2(max(1.0, count / width))))) > each:
        width = max(1, width * 3 // 4)
    places, low, high = [np.arange(min(width, count))], min(width, count), min(2 * width, count)
    while low < high:
        step = (high - low) / width
        places.append((low + (np.arange(width) + rng.random()) * step).astype(np.intp))
        low, high = high, min(2 * high, count)
    chosen: NDArray[np.intp] = np.unique(np.minimum(np.concatenate(places), count - 1))
    return chosen


def _add_nearest(found: _Found, rows: IntArray, tasks: IntArray) -> None:
    """Add the pairs of each agent with the `NEAREST` tasks."""
    from scipy.spatial import cKDTree

    reach = found.instance.reach
    tasks = tasks[~np.isnan(reach.goal[tasks, 0])]
    place = reach.place[reach.origin[found.agents[rows]]]
    placed = ~np.isnan(place[:, 0])
    if len(tasks) and placed.any():
        count = min(NEAREST, len(tasks))
        _, near = cKDTree(reach.goal[tasks]).query(place[placed], k=count)
        found.add_pairs(np.repeat(rows[placed], count), tasks[near.ravel()])
