"""Reach: which tasks an agent can take (C(i) of the paper) and how far it flies to them (1).

Agents that start at one place with the same range, battery and list of tasks share one row: their *origin*. Paper
instances have as many origins as tasks, whatever the number of agents.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.metric import distance_table, distances
from alloc.problems.distances.neighbours import Neighbours, estimated_pairs, find_neighbours
from alloc.problems.distances.origins import group_rows, number_lists
from alloc.problems.fields import ReadOnly

TOLERANCE = 1e-9
"""Slack on ranges (in distance) and batteries (in energy)."""

TABLE_LIMIT = 4_000_000
"""Pairs of origin and task up to which all questions are answered from a table."""

MOST_NEIGHBOURS = 100_000_000
"""Pairs within reach beyond which they are not gathered."""

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Reach(ReadOnly):
    """Reachable tasks and distances per origin.

    Attributes
    ----------
    origin : ndarray of int, shape (n,)
        Origin of each agent.
    place : ndarray, shape (origins, 3)
        Where the origin is; NaN where unknown.
    goal : ndarray, shape (m, 3)
        Where the tasks are; NaN where unknown.
    communication_range, battery : ndarray, shape (origins,)
        Limits on the distance, and on the energy for it.
    energy_per_distance : float
    list_of : ndarray of int, shape (origins,)
        Which of `lists` the origin is bound to; -1 where it may do all tasks.
    lists : tuple of ndarray of int
        Distinct lists of tasks, each sorted.
    """

    origin: Indices
    place: Floats
    goal: Floats
    communication_range: Floats
    battery: Floats
    energy_per_distance: float
    list_of: Indices
    lists: tuple[Indices, ...]

    @property
    def pairs(self) -> int:
        """Number of pairs of origin and task, within reach or not."""
        return len(self.place) * len(self.goal)

    @property
    def has_table(self) -> bool:
        """Whether `distance` and `mask` are small enough to be made without a thought, whatever was asked before."""
        return self.pairs <= TABLE_LIMIT

    @cached_property
    def distance(self) -> Floats:
        """Distance from each origin to each task, 0 where either place is unknown (1); shape (origins, m).

        Takes O(origins * m) time and memory: nothing for instances of any size, unless `has_table`.
        """
        table = distance_table(self.place, self.goal)
        table.setflags(write=False)
        return table

    @cached_property
    def mask(self) -> Flags:
        """Whether each task is in C(i): allowed, within range, and within the battery; shape (origins, m).

        Takes O(origins * m) time and memory: nothing for instances of any size, unless `has_table`.
        """
        mask = self._mask_of(np.arange(len(self.place)), self.distance)
        mask.setflags(write=False)
        return mask

    @cached_property
    def radius(self) -> Floats:
        """Distance beyond which nothing is within reach, before any tolerance on it; shape (origins,)."""
        radius = self.communication_range + TOLERANCE
        if self.energy_per_distance > 0:
            with np.errstate(over="ignore"):
                radius = np.minimum(radius, (self.battery + TOLERANCE) / self.energy_per_distance)
        return radius

    @cached_property
    def is_complete(self) -> bool:
        """Whether every agent can take every task."""
        if any(len(tasks) < len(self.goal) for tasks in self.lists):
            return False
        return self._is_complete_by_place()

    @cached_property
    def neighbours(self) -> Neighbours | None:
        """The tasks within reach of each origin; None where there are more than can be held (`MOST_NEIGHBOURS`)."""
        if not self.has_table and estimated_pairs(self) > MOST_NEIGHBOURS:
            return None
        return find_neighbours(self)

    @cached_property
    def density(self) -> float:
        """Share of the tasks that an agent can take, on average; by a sample where nobody could count them all."""
        m = len(self.goal)
        if self.has_table:
            return float(self.mask.mean(axis=1)[self.origin].mean())
        if self.is_complete:
            return 1.0
        if self.neighbours is None:
            return estimated_pairs(self) / self.pairs
        return float(np.diff(self.neighbours.first)[self.origin].mean() / m)

    @cached_property
    def agents_by_origin(self) -> tuple[Indices, Indices]:
        """Where each origin's agents begin in the second array, shape (origins + 1,); and all agents by origin."""
        order = np.argsort(self.origin, kind="stable")
        return np.searchsorted(self.origin[order], np.arange(len(self.place) + 1)), order

    def allows(self, agent: Indices, task: Indices) -> Flags:
        """Whether each of the agents can take the task beside it; both of shape (k,), and so is the answer."""
        origin = self.origin[agent]
        if self.has_table:
            return self.mask[origin, task]
        return self.is_within(origin, task, self.distances_between(origin, task))

    def distance_of(self, agent: Indices, task: Indices) -> Floats:
        """Distance from each agent's start to the task beside it; both of shape (k,), and so is the answer."""
        origin = self.origin[agent]
        return self.distance[origin, task] if self.has_table else self.distances_between(origin, task)

    def rows(self, origins: Indices) -> tuple[Floats, Flags]:
        """Return these rows of `distance` and `mask`, each of shape (k, m)."""
        if self.has_table:
            return self.distance[origins], self.mask[origins]
        distance = distance_table(self.place[origins], self.goal)
        return distance, self._mask_of(origins, distance)

    def block(self, origins: Indices, tasks: Indices) -> tuple[Floats, Flags]:
        """Return these rows and columns of `distance` and `mask`, each of shape (k, l), without a table."""
        distance = distance_table(self.place[origins], self.goal[tasks])
        return distance, self.is_within(origins[:, None], tasks, distance)

    def agents_of(self, task: int) -> Indices:
        """Return the agents that can take `task`, in ascending order."""
        if self.has_table:
            return np.flatnonzero(self.mask[self.origin, task])
        if self.is_complete:
            return np.arange(len(self.origin))
        origins = np.arange(len(self.place))
        goals = np.full(len(origins), task)
        able = self.is_within(origins, goals, self.distances_between(origins, goals))
        return np.flatnonzero(able[self.origin])

    def distances_between(self, origin: Indices, task: Indices) -> Floats:
        """Distance from each of these origins to the task beside it, without a table."""
        return distances(self.place[origin], self.goal[task])

    def is_within(self, origin: Indices, task: Indices, distance: Floats) -> Flags:
        """Whether each of these origins can take the task beside it, which is `distance` away; without a table."""
        within = self._is_near(origin, distance)
        if self.lists:
            within &= self._is_allowed(self.list_of[origin], task)
        return within

    def _is_near(self, origin: Indices, distance: Floats) -> Flags:
        near: Flags = distance <= self.communication_range[origin] + TOLERANCE
        if np.isfinite(self.battery).any():
            with np.errstate(over="ignore"):
                near &= self.energy_per_distance * distance <= self.battery[origin] + TOLERANCE
        return near

    def _is_allowed(self, number: Indices, task: Indices) -> Flags:
        keys, m = self._list_keys, len(self.goal)
        wanted = number * m + task
        found = np.searchsorted(keys, wanted)
        allowed: Flags = (number < 0) | (keys[np.minimum(found, len(keys) - 1)] == wanted)
        return allowed

    @cached_property
    def _list_keys(self) -> Indices:
        """List times m plus task for every entry of every list, ascending, and an end that no key equals."""
        m = len(self.goal)
        keys = [number * m + tasks for number, tasks in enumerate(self.lists)]
        return np.concatenate([*keys, [len(self.lists) * m]])

    def _mask_of(self, origins: Indices, distance: Floats) -> Flags:
        mask = self._is_near(origins[:, None], distance)
        for row in np.flatnonzero(self.list_of[origins] >= 0).tolist():
            allowed = self.lists[self.list_of[origins[row]]]
            reached = mask[row, allowed]
            mask[row] = False
            mask[row, allowed] = reached
        return mask

    def _is_complete_by_place(self) -> bool:
        """Look at the farthest corner of the tasks' box, then at all tasks of those that it leaves in doubt."""
        known = self.goal[~np.isnan(self.goal[:, 0])]
        if not len(known):
            return True
        low, high = known.min(axis=0), known.max(axis=0)
        corner = np.where(self.place > low / 2 + high / 2, low, high)
        with np.errstate(over="ignore", invalid="ignore"):
            farthest = distances(self.place, corner) * (1 + 1e-12)
            doubtful = np.flatnonzero(~self._is_near(np.arange(len(self.place)), farthest))
            worst = doubtful[np.argsort((self.radius - farthest)[doubtful])]
        rows = max(1, TABLE_LIMIT // (8 * len(self.goal)))
        parts = (worst[begin : begin + rows] for begin in range(0, len(worst), rows))
        return all(self._is_near(part[:, None], self._far(part)).all() for part in parts)

    def _far(self, origins: Indices) -> Floats:
        return distance_table(self.place[origins], self.goal)


def build_reach(
    place: Floats,
    goal: Floats,
    communication_range: Floats,
    battery: Floats,
    energy_per_distance: float,
    allowed_tasks: Sequence[Indices | None] | None,
) -> Reach:
    """Group agents by origin; takes O(n log n) time and O(n) memory.

    Parameters
    ----------
    place, goal : ndarray, shapes (n, 3) and (m, 3)
        Where agents begin, and where tasks are; NaN where unknown.
    communication_range, battery : ndarray, shape (n,)
    energy_per_distance : float
    allowed_tasks : sequence of (ndarray of int, or None), or None
        As in `Instance`.
    """
    number, lists = number_lists(allowed_tasks, len(place))
    first, origin = group_rows([*place.T, communication_range, battery, number.astype(np.float64)])
    places, list_of = place[first], number[first]
    for array in (origin, places, list_of):
        array.setflags(write=False)
    return Reach(origin, places, goal, communication_range[first], battery[first], energy_per_distance, list_of, lists)
