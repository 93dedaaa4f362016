"""Data of tasks that is reused between decisions: distances, nearest tasks, deadlines."""

import numpy as np

from alloc.allocators.online.routes.situation import Floats, Ints
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.distances.metric import distance_table, distances, manhattan_distances
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import TaskReport, View
from alloc.problems.vocabulary import GEOGRAPHIC, MANHATTAN

NEAR = 24
"""Number of nearest tasks kept for each task."""

SPARE_DISTANCES = 10_000
"""Number of distances in addition to those between the present tasks; above four times the sum, all are dropped."""


def positions(places: list[Place]) -> Floats:
    """Return the positions of places, shape (p, 3); NaN where unknown."""
    return np.array([place.position or (np.nan,) * 3 for place in places], np.float64)


def by_metric(metric: str, sources: Floats, goals: Floats) -> Floats:
    """Return the Euclidean or Manhattan distances between positions, shape (sources, goals)."""
    table = distance_table(sources, goals, manhattan_distances if metric == MANHATTAN else distances)
    return np.ascontiguousarray(table, np.float64)


def is_fixed(view: View) -> bool:
    """Return whether distances do not follow from Cartesian positions, so that agents cannot be diverted in flight."""
    return view.has_table or view.metric == GEOGRAPHIC


class TaskTables:
    """Cached data of the tasks of one mission, rebuilt only when tasks are added.

    Attributes
    ----------
    site : ndarray, shape (k, 3)
        Positions of all tasks at the time of the last rebuild.
    growth, priority, deadline, appears : ndarray, shape (k,)
    rows : ndarray, shape (m,)
        Rows of the present tasks.
    """

    def __init__(self) -> None:
        self._row: dict[str, int] = {}
        self._ways: dict[tuple[str, str], float] = {}
        self.rows = np.empty(0, np.int64)

    def look_up(self, view: View, tasks: list[TaskReport]) -> None:
        """Set `rows` to the rows of `tasks`; rebuild the tables if some tasks are new."""
        if not all(task.facts.id in self._row for task in tasks):
            self._row = {task.facts.id: j for j, task in enumerate(tasks)}
            facts = [task.facts for task in tasks]
            self.site = positions([one.place for one in facts])
            self.growth, self.priority, self.deadline, self.appears = (
                np.array([getattr(one, name) for one in facts], np.float64)
                for name in ("growth", "priority", "deadline", "appears")
            )
            self._distance = (
                self._between(view, tasks) if is_fixed(view) else by_metric(view.metric, self.site, self.site)
            )
            self._order = np.argsort(self._distance, axis=1, kind="stable")
        self.rows = np.array([self._row[task.facts.id] for task in tasks], np.int64)

    def distances(self) -> tuple[Floats, Ints]:
        """Return the distances between the present tasks, and the nearest tasks of each, nearest first."""
        m = len(self.rows)
        if m == len(self._distance):
            return self._distance, np.ascontiguousarray(self._order[:, : min(NEAR + 1, m)])
        column = np.full(len(self._distance), -1)
        column[self.rows] = np.arange(m)
        near = _nearest(self._order, self.rows, column, min(NEAR + 1, m))
        return self._distance[np.ix_(self.rows, self.rows)], near

    def _between(self, view: View, tasks: list[TaskReport]) -> Floats:
        table = np.zeros((len(tasks), len(tasks)))
        if len(self._ways) > 4 * (table.size + SPARE_DISTANCES):
            self._ways.clear()  # drops distances of tasks closed long ago
        for i, one in enumerate(tasks):
            for j, other in enumerate(tasks):
                pair = one.facts.id, other.facts.id
                if pair not in self._ways:
                    self._ways[pair] = view.between(one, other)
                table[i, j] = self._ways[pair]
        return table


@compiled
def _nearest(order: Ints, rows: Ints, column: Ints, count: int) -> Ints:
    """Return the first `count` present tasks in the order of each row."""
    near = np.empty((len(rows), count), np.int64)
    for j in range(len(rows)):
        found, k = 0, 0
        while found < count:
            if column[order[rows[j], k]] >= 0:
                near[j, found] = column[order[rows[j], k]]
                found += 1
            k += 1
    return near
