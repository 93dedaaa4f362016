"""Reach: the tasks that an agent can take (C(i) of the paper) and their distances (1).

Agents at the same place with the same range, battery and list of tasks share one row, their *origin*. Instances of the
paper have as many origins as tasks, whatever the number of agents.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.geometry import Geometry
from alloc.problems.distances.move import Move
from alloc.problems.distances.neighbours import Neighbours, estimated_pairs, find_neighbours
from alloc.problems.distances.origins import list_keys
from alloc.problems.fields import ReadOnly

TOLERANCE = 1e-9
"""Absolute tolerance on ranges (distance) and batteries (energy)."""

TABLE_LIMIT = 4_000_000
"""Number of pairs of origin and task up to which full tables are used."""

MAX_NEIGHBOURS = 100_000_000
"""Maximum number of pairs within reach that are stored as sparse rows."""

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Reach(ReadOnly):
    """Reachable tasks, distances and costs per origin.

    Attributes
    ----------
    origin : ndarray of int, shape (n,)
        Origin of each agent.
    geometry : Geometry
        Positions of origins and tasks, and distances between them.
    communication_range, battery : ndarray, shape (origins,)
        Limits on the distance and on the energy of a flight.
    energy_per_distance : float
        Energy per unit of cost.
    factor : ndarray, shape (origins,), or None
        Energy per unit of distance of each origin divided by `energy_per_distance`; None if all are 1.
    returns : ndarray of bool, shape (origins,), or None
        Whether the flight back counts, see `Geometry.home`; None if no agent returns.
    list_of : ndarray of int, shape (origins,)
        Index in `lists` of each origin's allowed tasks; -1 if it may do all tasks.
    lists : tuple of ndarray of int
        Distinct lists of tasks, each sorted.
    move : Move or None
        Price of moving agents away from their current tasks, if any.
    """

    origin: Indices
    geometry: Geometry
    communication_range: Floats
    battery: Floats
    energy_per_distance: float
    factor: Floats | None
    returns: Flags | None
    list_of: Indices
    lists: tuple[Indices, ...]
    move: Move | None = None

    @property
    def place(self) -> Floats:
        """Cartesian position of each origin, shape (origins, 3); NaN where unknown."""
        return self.geometry.place

    @property
    def goal(self) -> Floats:
        """Cartesian position of each task, shape (m, 3); NaN where unknown."""
        return self.geometry.goal

    @property
    def cost_is_distance(self) -> bool:
        """Whether the cost of every flight is its distance."""
        return self.factor is None and self.returns is None and self.move is None

    @property
    def is_plain(self) -> bool:
        """Whether costs are Euclidean distances (1), so that compiled code only needs coordinates."""
        return self.cost_is_distance and self.geometry.is_euclidean

    @property
    def pairs(self) -> int:
        """Number of all pairs of origin and task."""
        return len(self.place) * len(self.goal)

    @property
    def has_table(self) -> bool:
        """Whether `distance` and `mask` are small enough for full tables; independent of earlier calls."""
        return self.pairs <= TABLE_LIMIT

    @cached_property
    def distance(self) -> Floats:
        """Distance from each origin to each task, 0 where either place is unknown (1); shape (origins, m).

        Takes O(origins * m) time and memory; avoid it unless `has_table`.
        """
        table = self.geometry.table(np.arange(len(self.place)))
        table.setflags(write=False)
        return table

    @cached_property
    def cost(self) -> Floats:
        """Cost of the flight from each origin to each task, see `costs`; shape (origins, m), like `distance`."""
        if self.cost_is_distance:
            return self.distance
        cost = self.costs(np.arange(len(self.place))[:, None], np.arange(len(self.goal)), self.distance)
        cost.setflags(write=False)
        return cost

    @cached_property
    def mask(self) -> Flags:
        """Whether each task is in C(i): allowed, within range, and within the battery; shape (origins, m).

        Takes O(origins * m) time and memory; avoid it unless `has_table`.
        """
        mask = self._mask_of(np.arange(len(self.place)), self.distance)
        mask.setflags(write=False)
        return mask

    @cached_property
    def radius(self) -> Floats:
        """Maximum distance of tasks within reach, without tolerance; shape (origins,)."""
        radius = self.communication_range + TOLERANCE
        if self.energy_per_distance > 0:
            with np.errstate(over="ignore", divide="ignore"):
                flight = (self.battery + TOLERANCE) / self.energy_per_distance
                radius = np.minimum(radius, flight if self.factor is None else flight / self.factor)
        return radius

    @cached_property
    def is_complete(self) -> bool:
        """Whether every agent can take every task."""
        if any(len(tasks) < len(self.goal) for tasks in self.lists):
            return False
        return self._is_complete_by_place()

    @cached_property
    def neighbours(self) -> Neighbours | None:
        """Tasks within reach of each origin; None if there are more than `MAX_NEIGHBOURS` pairs."""
        if not self.has_table and estimated_pairs(self) > MAX_NEIGHBOURS:
            return None
        return find_neighbours(self)

    @cached_property
    def density(self) -> float:
        """Mean share of tasks that an agent can take; estimated from a sample if there are too many pairs to count."""
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
        """Offset of each origin's agents in the second array, shape (origins + 1,); and all agents by origin."""
        order = np.argsort(self.origin, kind="stable")
        return np.searchsorted(self.origin[order], np.arange(len(self.place) + 1)), order

    def allows(self, agent: Indices, task: Indices) -> Flags:
        """Return whether each agent can take its task; arguments and result have shape (k,)."""
        origin = self.origin[agent]
        if self.has_table:
            return self.mask[origin, task]
        return self.is_within(origin, task, self.distances_between(origin, task))

    def distance_of(self, agent: Indices, task: Indices) -> Floats:
        """Return the distance from each agent's start to its task; arguments and result have shape (k,)."""
        origin = self.origin[agent]
        return self.distance[origin, task] if self.has_table else self.distances_between(origin, task)

    def rows(self, origins: Indices) -> tuple[Floats, Flags]:
        """Return rows of `distance` and `mask`, each of shape (k, m)."""
        if self.has_table:
            return self.distance[origins], self.mask[origins]
        distance = self.geometry.table(origins)
        return distance, self._mask_of(origins, distance)

    def block(self, origins: Indices, tasks: Indices) -> tuple[Floats, Flags]:
        """Return blocks of `distance` and `mask`, each of shape (k, l), without building the full table."""
        distance = self.geometry.table(origins, tasks)
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
        """Return the distance from each origin to its task, without building the full table."""
        return self.geometry.between(origin, task)

    def cost_of(self, agent: Indices, task: Indices) -> Floats:
        """Return the cost of each agent's flight to its task; arguments and result have shape (k,)."""
        origin = self.origin[agent]
        if self.has_table:
            return self.cost[origin, task]
        return self.costs(origin, task, self.distances_between(origin, task))

    def costs(self, origin: Indices, task: Indices, distance: Floats) -> Floats:
        """Return the cost of the flight from each origin to its task, which is `distance` away, in units of distance.

        This is the energy of the flight, including the way back if the agent returns, divided by `energy_per_distance`,
        plus the price of moving to another task.
        """
        cost = self.flown(origin, task, distance)
        return cost if self.move is None else cost * self.move.energy_weight + self.move.of(origin, task)

    def trips(self, origin: Indices, task: Indices, distance: Floats) -> Floats:
        """Return the length of the flight from each origin to its task, `distance` away, and back if it returns."""
        if self.returns is None:
            return distance
        both = self.geometry.there_and_back(origin, task, distance)
        trips: Floats = np.where(self.returns[origin], both, distance)
        return trips

    def flown(self, origin: Indices, task: Indices, distance: Floats) -> Floats:
        """Return the cost without the price of moves: energy divided by `energy_per_distance`."""
        trips = self.trips(origin, task, distance)
        return trips if self.factor is None else trips * self.factor[origin]

    def is_within(self, origin: Indices, task: Indices, distance: Floats) -> Flags:
        """Return whether each origin can take its task, which is `distance` away, without building the full table."""
        within = self._is_near(origin, task, distance)
        if self.lists:
            within &= self._is_allowed(self.list_of[origin], task)
        return within

    def _is_near(self, origin: Indices, task: Indices, distance: Floats) -> Flags:
        limited = bool(np.isfinite(self.battery).any())
        with np.errstate(over="ignore"):
            return self._is_enough(origin, distance, self.flown(origin, task, distance) if limited else None)

    def _is_enough(self, origin: Indices, distance: Floats, flown: Floats | None) -> Flags:
        """Return whether range and, unless `flown` is None, battery suffice for flights with these lengths."""
        near: Flags = distance <= self.communication_range[origin] + TOLERANCE
        if flown is not None:
            near &= self.energy_per_distance * flown <= self.battery[origin] + TOLERANCE
        return near

    def _is_allowed(self, number: Indices, task: Indices) -> Flags:
        keys, m = self._list_keys, len(self.goal)
        wanted = number * m + task
        found = np.searchsorted(keys, wanted)
        allowed: Flags = (number < 0) | (keys[np.minimum(found, len(keys) - 1)] == wanted)
        return allowed

    @cached_property
    def _list_keys(self) -> Indices:
        return list_keys(self.lists, len(self.goal))

    def _mask_of(self, origins: Indices, distance: Floats) -> Flags:
        mask = self._is_near(origins[:, None], np.arange(len(self.goal)), distance)
        for row in np.flatnonzero(self.list_of[origins] >= 0).tolist():
            allowed = self.lists[self.list_of[origins[row]]]
            reached = mask[row, allowed]
            mask[row] = False
            mask[row, allowed] = reached
        return mask

    def _is_complete_by_place(self) -> bool:
        """Return whether all tasks are within reach, by the box of all tasks, then exactly for undecided origins."""
        if not (np.isfinite(self.communication_range).any() or np.isfinite(self.battery).any()):
            return True
        known = self.goal[~np.isnan(self.goal[:, 0])]
        if not len(known) and self.geometry.given is None:
            return True
        origins = np.arange(len(self.place))
        if self.geometry.given is None:
            low, high = known.min(axis=0), known.max(axis=0)
            with np.errstate(over="ignore", invalid="ignore"):
                ways = (self.geometry, self.geometry.home or self.geometry)
                farthest, back = (way.farthest(low, high) * (1 + 1e-12) for way in ways)
                longest = farthest if self.returns is None else farthest + np.where(self.returns, back, 0.0)
                flown = longest if self.factor is None else longest * self.factor
                doubtful = np.flatnonzero(~self._is_enough(origins, farthest, flown))
                worst = doubtful[np.argsort((self.radius - farthest)[doubtful])]
        else:
            worst = origins
        tasks = np.arange(len(self.goal))
        rows = max(1, TABLE_LIMIT // (8 * len(self.goal)))
        parts = (worst[begin : begin + rows] for begin in range(0, len(worst), rows))
        return all(self._is_near(part[:, None], tasks, self.geometry.table(part)).all() for part in parts)
