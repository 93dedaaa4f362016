"""Distances between origins and tasks, by a metric or as given by the user for some pairs."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from alloc.problems.distances.geodesic import METRES, embedded, geodesic_distances
from alloc.problems.distances.given import DistanceTable
from alloc.problems.distances.metric import (
    Floats,
    distance_table,
    distances,
    manhattan_distances,
)
from alloc.problems.distances.origins import entries
from alloc.problems.fields import IntArray, ReadOnly
from alloc.problems.vocabulary import EUCLIDEAN, GEOGRAPHIC, MANHATTAN

LONGEST_GEODESIC_M = 20_003_932.0
"""Distance between the poles, the largest on the earth."""


@dataclass(frozen=True, eq=False)
class GivenRows(ReadOnly):
    """Pairs with given distances: those of origin i are ``first[i]:first[i + 1]``, in ascending order of tasks.

    Attributes
    ----------
    first : ndarray of int, shape (origins + 1,)
    task : ndarray of int, shape (pairs,)
    there, back : ndarray, shape (pairs,)
        Distances from the origin to the task, and from the task to the origin.
    m : int
        Number of tasks.
    """

    first: IntArray
    task: IntArray
    there: Floats
    back: Floats
    m: int

    @cached_property
    def _keys(self) -> IntArray:
        """Keys origin * m + task of all pairs, followed by a sentinel."""
        return np.append(self.origin * self.m + self.task, (len(self.first) - 1) * self.m)

    @property
    def origin(self) -> IntArray:
        """The origin of each pair."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def chosen(self, origins: IntArray) -> "GivenRows":
        """Return the rows of some origins, in this order."""
        origin, entry = entries(self.first, np.arange(len(origins)), origins)
        first = np.searchsorted(origin, np.arange(len(origins) + 1))
        return GivenRows(first, self.task[entry], self.there[entry], self.back[entry], self.m)

    def renumbered(self, number: IntArray, m: int) -> "GivenRows":
        """Return the rows with task j renumbered to ``number[j]``, or dropped if that is -1."""
        task = number[self.task]
        kept = np.flatnonzero(task >= 0)
        origin = self.origin[kept]
        order = kept[np.lexsort((task[kept], origin))]
        first = np.searchsorted(origin, np.arange(len(self.first)))
        return GivenRows(first, task[order], self.there[order], self.back[order], m)

    def replace(self, default: Floats, values: Floats, origin: IntArray, task: IntArray) -> Floats:
        """Return `default`, with entries of `values` for given pairs; all arguments broadcast to its shape."""
        wanted = np.broadcast_to(origin * self.m + task, default.shape)
        found = np.searchsorted(self._keys, wanted)
        given = self._keys[found] == wanted
        result = default.copy()
        result[given] = values[found[given]]
        return result


@dataclass(frozen=True, eq=False)
class Geometry(ReadOnly):
    """Distances of all origins and tasks.

    Attributes
    ----------
    start, task_position : ndarray, shape (origins, 3) and (m, 3)
        Coordinates as in the instance; NaN where unknown.
    metric : str
        One of `metric.METRICS`.
    unit : str
        Unit of geographic distances.
    given : GivenRows or None
    home : Geometry or None
        Geometry of the places to which origins return; None if all return to their starts or not at all.
    """

    start: Floats
    task_position: Floats
    metric: str = EUCLIDEAN
    unit: str = "km"
    given: GivenRows | None = None
    home: "Geometry | None" = None

    @property
    def is_euclidean(self) -> bool:
        """Whether all distances are Euclidean (1)."""
        return self.metric == EUCLIDEAN and self.given is None

    @cached_property
    def place(self) -> Floats:
        """Cartesian coordinates of the origins; straight lines are no longer than the metric's distances."""
        return embedded(self.start, self.unit) if self.metric == GEOGRAPHIC else self.start

    @cached_property
    def goal(self) -> Floats:
        """Cartesian coordinates of the tasks, as for `place`."""
        return embedded(self.task_position, self.unit) if self.metric == GEOGRAPHIC else self.task_position

    def chosen(self, origins: IntArray) -> "Geometry":
        """Return the geometry of some origins, in this order."""
        given = None if self.given is None else self.given.chosen(origins)
        home = None if self.home is None else self.home.chosen(origins)
        return replace(self, start=self.start[origins], given=given, home=home)

    def restricted(self, tasks: IntArray, number: IntArray) -> "Geometry":
        """Return the geometry of `tasks`, with task j renumbered to ``number[j]``, -1 for dropped ones."""
        given = None if self.given is None else self.given.renumbered(number, len(tasks))
        home = None if self.home is None else self.home.restricted(tasks, number)
        return replace(self, task_position=self.task_position[tasks], given=given, home=home)

    def between(self, origin: IntArray, task: IntArray) -> Floats:
        """Return the distance from each origin to its task; both broadcast."""
        distance = self._by_metric(self.start[origin], self.task_position[task])
        return distance if self.given is None else self.given.replace(distance, self.given.there, origin, task)

    def table(self, origins: IntArray, tasks: IntArray | slice = slice(None)) -> Floats:
        """Return the distances from all these origins to all these tasks, shape (k, l)."""
        table = distance_table(self.start[origins], self.task_position[tasks], self._by_metric)
        if self.given is None:
            return table
        return self.given.replace(table, self.given.there, origins[:, None], np.arange(self.given.m)[tasks])

    def there_and_back(self, origin: IntArray, task: IntArray, distance: Floats) -> Floats:
        """Return the length of the flight from each origin to its task, which is `distance` away, and back home."""
        if self.home is not None:
            return distance + self.home.back(origin, task)
        back = distance if self.given is None else self.given.replace(distance, self.given.back, origin, task)
        return distance + back

    def back(self, origin: IntArray, task: IntArray) -> Floats:
        """Return the distance from each task back to its origin, or all distances if `origin` is a column."""
        if origin.ndim == 2:
            way = distance_table(self.start[origin[:, 0]], self.task_position[task], self._by_metric)
        else:
            way = self._by_metric(self.start[origin], self.task_position[task])
        return way if self.given is None else self.given.replace(way, self.given.back, origin, task)

    def farthest(self, low: Floats, high: Floats) -> Floats:
        """Return an upper bound on each origin's distance to the places in a box, by its corners; shape (origins,)."""
        corner = np.where(self.place > low / 2 + high / 2, low, high)
        if self.metric == MANHATTAN:
            return manhattan_distances(self.place, corner)
        if self.metric == GEOGRAPHIC:
            height = np.concatenate([self.start[:, 2], self.task_position[:, 2]])
            height = height[~np.isnan(height)]
            climb = float(np.ptp(height)) if len(height) else 0.0
            return np.full(len(self.start), (LONGEST_GEODESIC_M + climb) / METRES[self.unit])
        return distances(self.place, corner)

    def _by_metric(self, place: Floats, goal: Floats) -> Floats:
        if self.metric == GEOGRAPHIC:
            return geodesic_distances(place, goal, self.unit)
        return manhattan_distances(place, goal) if self.metric == MANHATTAN else distances(place, goal)


def given_rows(table: DistanceTable, nodes: IntArray, start_task: IntArray) -> GivenRows:
    """Return the given distances of agents or bases; for nodes without a row, those of the start task.

    Parameters
    ----------
    table : DistanceTable
    nodes : ndarray of int, shape (origins,)
        Node of an agent of each origin, or of a base, in the numbering of the table.
    start_task : ndarray of int, shape (origins,)
        Task at which each agent starts, -1 for none.
    """
    node, task, there, back = table.to_tasks()
    begin = np.searchsorted(node, np.arange(table.size + 1))
    origins = np.arange(len(nodes))
    placed = start_task >= 0
    own = entries(begin, origins, nodes)
    by_task = entries(begin, origins[placed], table.n + start_task[placed])
    origin = np.concatenate([own[0], by_task[0], origins[placed]])
    goal = np.concatenate([task[own[1]], task[by_task[1]], start_task[placed]])
    none = np.zeros(int(placed.sum()))  # the distance to the own place
    out, home = (np.concatenate([way[own[1]], way[by_task[1]], none]) for way in (there, back))
    key, first = np.unique(origin * table.m + goal, return_index=True)
    origin, goal = np.divmod(key, table.m)
    rows = GivenRows(np.searchsorted(origin, np.arange(len(nodes) + 1)), goal, out[first], home[first], table.m)
    for array in (rows.first, rows.task, rows.there, rows.back):
        array.setflags(write=False)
    return rows
