"""Tasks within reach of each origin as compressed sparse rows, for short ranges."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.geometry import Geometry
from alloc.problems.distances.origins import entries
from alloc.problems.vocabulary import MANHATTAN

CHUNK = 1 << 21
"""Approximate number of pairs of origin and task that are processed together."""

SAMPLE = 256
"""Number of origins in the sample from which numbers of pairs are estimated."""

MARGIN = 1e-9
"""Relative margin on radii, before the exact rule is applied."""


Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class ReachRule(Protocol):
    """The part of `Reach` that is used here."""

    @property
    def place(self) -> Floats:
        """Position of each origin, shape (origins, 3)."""

    @property
    def goal(self) -> Floats:
        """Position of each task, shape (m, 3)."""

    @property
    def geometry(self) -> Geometry:
        """Distances between origins and tasks."""

    @property
    def list_of(self) -> Indices:
        """List of allowed tasks of each origin, -1 for none."""

    @property
    def lists(self) -> tuple[Indices, ...]:
        """Distinct lists of tasks."""

    @property
    def radius(self) -> Floats:
        """Maximum distance of tasks within reach, shape (origins,)."""

    def rows(self, origins: Indices) -> tuple[Floats, NDArray[np.bool_]]:
        """Return rows of distances and of the reachability mask."""

    def distances_between(self, origin: Indices, task: Indices) -> Floats:
        """Return the distance from each origin to its task."""

    def is_within(self, origin: Indices, task: Indices, distance: Floats) -> NDArray[np.bool_]:
        """Return whether each origin can take its task."""


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Compressed sparse rows: the tasks of origin i are ``task[first[i]:first[i + 1]]``, in ascending order.

    Attributes
    ----------
    first : ndarray of int, shape (origins + 1,)
    task : ndarray of int32, shape (pairs,)
    distance : ndarray, shape (pairs,)
        Bitwise equal to `Reach.distance`.
    """

    first: NDArray[np.intp]
    task: NDArray[np.int32]
    distance: NDArray[np.float64]

    def by_task(self, m: int) -> tuple[Indices, Indices]:
        """Return the pairs in column-major form: the offset of each task, shape (m + 1,), and the origins by task."""
        from scipy.sparse import csr_matrix

        ones = np.ones(len(self.task), dtype=np.int8)
        columns = csr_matrix((ones, self.task, self.first), shape=(len(self.first) - 1, m)).tocsc()
        return columns.indptr, columns.indices

    @property
    def origin(self) -> NDArray[np.int32]:
        """Origin of each pair, shape (pairs,)."""
        return np.repeat(np.arange(len(self.first) - 1, dtype=np.int32), np.diff(self.first))


Pairs = tuple[Indices, Indices]


def find_neighbours(reach: ReachRule) -> Neighbours:
    """Return the tasks within reach of each origin, usually in time and memory proportional to their number."""
    origins, m = len(reach.place), len(reach.goal)
    rows, tasks, flown = [], [], []
    for origin, task in _candidates(reach):
        distance = reach.distances_between(origin, task)
        keep = np.flatnonzero(reach.is_within(origin, task, distance))
        keep = keep[np.argsort(origin[keep] * m + task[keep])]
        rows.append(origin[keep].astype(np.int32))
        tasks.append(task[keep].astype(np.int32))
        flown.append(distance[keep])
    row, column, away = np.concatenate(rows), np.concatenate(tasks), np.concatenate(flown)
    del rows, tasks, flown
    if (row[1:] < row[:-1]).any():  # the pairs of an origin are consecutive, but origins are not sorted
        order = np.argsort(row, kind="stable")
        column, away = column[order], away[order]
    first = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=origins))]).astype(np.intp)
    for array in (first, column, away):
        array.setflags(write=False)
    return Neighbours(first, column, away)


def estimated_pairs(reach: ReachRule) -> float:
    """Return an estimate of the number of pairs within reach, from a sample of the origins."""
    origins = len(reach.place)
    sample = np.unique(np.linspace(0, origins - 1, SAMPLE).astype(np.intp))
    return float(reach.rows(sample)[1].sum(axis=1).mean() * origins)


def nearest_distance(reach: ReachRule, wanted: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the distance to the nearest of the `wanted` tasks within reach, ``inf`` if none; shape (origins,).

    Origins with a list use the tasks on it, others a spatial tree of all tasks. If distances are not Euclidean, the
    result may be a lower bound, the length of a straight line.
    """
    from scipy.spatial import cKDTree

    nearest = np.full(len(reach.place), np.inf)
    listed = np.flatnonzero(reach.list_of >= 0)
    for origin, task in _on_lists(reach, listed):
        distance = reach.distances_between(origin, task)
        good = wanted[task] & reach.is_within(origin, task, distance)
        np.minimum.at(nearest, origin[good], distance[good])
    tasks, free = np.flatnonzero(wanted), np.flatnonzero(reach.list_of < 0)
    unknown = np.isnan(reach.goal[tasks, 0])
    lost = np.isnan(reach.place[free, 0]) | unknown.any()
    nearest[free[lost]] = 0.0 if len(tasks) else np.inf
    placed, known = free[~lost], tasks[~unknown]
    if len(placed) and len(known):
        axes = 1 if reach.geometry.metric == MANHATTAN else 2
        straight, found = cKDTree(reach.goal[known]).query(reach.place[placed], p=axes)
        if reach.geometry.is_euclidean and reach.geometry.home is None:  # the nearest is then the first within reach
            distance = reach.distances_between(placed, known[found])
            within = reach.is_within(placed, known[found], distance)
        else:
            distance = straight * (1 - MARGIN)
            within = distance <= reach.radius[placed]
        nearest[placed] = np.where(within, distance, np.inf)
    if reach.geometry.given is not None:
        given = reach.geometry.given
        origin, task, distance = given.origin, given.task, given.there
        good = wanted[task] & reach.is_within(origin, task, distance)
        np.minimum.at(nearest, origin[good], distance[good])
    return nearest


def _candidates(reach: ReachRule) -> Iterator[Pairs]:
    """Yield pairs that may be within reach; those of an origin are consecutive."""
    nothing = np.zeros(0, dtype=np.intp)
    yield nothing, nothing
    listed = reach.list_of >= 0
    radius = reach.radius * (1 + MARGIN)
    near = ~listed & ~np.isnan(reach.place[:, 0]) & np.isfinite(radius)
    yield from _on_lists(reach, np.flatnonzero(listed))
    yield from _everywhere(reach, np.flatnonzero(~listed & ~near))
    order = np.flatnonzero(near)
    yield from _around(reach, order[np.argsort(radius[order], kind="stable")], radius)


def _on_lists(reach: ReachRule, origins: Indices) -> Iterator[Pairs]:
    lengths = np.array(list(map(len, reach.lists)), dtype=np.intp)[reach.list_of[origins]] if len(origins) else origins
    for part in np.split(origins, _cuts(lengths)):
        if len(part):
            lists = [reach.lists[number] for number in reach.list_of[part].tolist()]
            yield np.repeat(part, list(map(len, lists))), np.concatenate(lists)


def _everywhere(reach: ReachRule, origins: Indices) -> Iterator[Pairs]:
    m = len(reach.goal)
    for part in np.split(origins, _cuts(np.full(len(origins), m))):
        if len(part):
            yield np.repeat(part, m), np.tile(np.arange(m), len(part))


def _around(reach: ReachRule, origins: Indices, radius: NDArray[np.float64]) -> Iterator[Pairs]:
    """Yield tasks in a ball around each origin, by a spatial tree; tasks without a place are always included."""
    from scipy.spatial import cKDTree

    known = np.flatnonzero(~np.isnan(reach.goal[:, 0]))
    unknown = np.flatnonzero(np.isnan(reach.goal[:, 0]))
    if len(known) and len(origins):
        tree = cKDTree(reach.goal[known])
    while len(origins):
        place = reach.place[origins]
        sample = np.unique(np.linspace(0, len(origins) - 1, SAMPLE).astype(np.intp))
        ball = radius[origins]
        most = tree.query_ball_point(place[sample], ball[sample], return_length=True).mean() if len(known) else 0
        size = max(1, int(CHUNK / (1 + most + len(unknown))))
        part, ball = origins[:size], ball[:size]
        pairs = [(np.repeat(part, len(unknown)), np.tile(unknown, len(part)))]
        if len(known):
            found = cKDTree(place[:size]).sparse_distance_matrix(tree, float(ball[-1]), output_type="ndarray")
            pairs.append((part[found["i"]], known[found["j"]]))
        given = reach.geometry.given
        if given is not None:
            origin, entry = entries(given.first, part, part)
            pairs.append((origin, given.task[entry]))
        origin, task = (np.concatenate([pair[side] for pair in pairs]) for side in (0, 1))
        if given is not None:  # exclude duplicates with given pairs
            origin, task = np.divmod(np.unique(origin * len(reach.goal) + task), len(reach.goal))
        yield origin, task
        origins = origins[size:]


def _cuts(lengths: Indices) -> Indices:
    """Return the boundaries of parts whose lengths sum to about `CHUNK`."""
    return np.flatnonzero(np.diff(np.cumsum(lengths) // CHUNK)) + 1
