"""Positions of tasks and agents on a map, and the bases where agents start or to which they return."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.text import heading
from alloc.problems.units import labels
from alloc.problems.vocabulary import GEOGRAPHIC

STEEPEST = 0.05
"""Least cosine of the latitude by which a map is stretched."""

MAX_BASES = 20_000
"""Maximum number of starting places that are shown; of more, which would overlap, a sample is shown."""


@dataclass(frozen=True, eq=False)
class Places:
    """The positions of an instance on a map.

    Attributes
    ----------
    tasks, starts : ndarray, shapes (m, 2) and (n, 2)
        Unknown positions are rows of NaN.
    aspect : float
        Drawn length of a unit of the vertical axis over that of a unit of the horizontal axis.
    axes : (str, str)
        Names of the axes, with units.
    homes : ndarray, shape (bases, 2)
        Positions of the bases to which agents return; unknown ones are rows of NaN.
    """

    tasks: FloatArray
    starts: FloatArray
    aspect: float
    axes: tuple[str, str]
    homes: FloatArray

    @property
    def known(self) -> FloatArray:
        """All known positions, shape (k, 2)."""
        every = np.vstack([self.tasks, self.starts, self.homes])
        return every[~np.isnan(every[:, 0])]

    def home_of(self, instance: Instance, agents: IntArray) -> FloatArray:
        """Return the base of each of these agents, shape (k, 2); NaN if it returns to its start or does not return."""
        return np.vstack([self.homes, [[np.nan, np.nan]]])[instance.return_base[agents]]


def places(instance: Instance) -> Places:
    """Return the positions on a map: longitudes and latitudes, or the coordinates on the two axes of largest spread."""
    if instance.metric != GEOGRAPHIC:
        plane = two_axes(instance)
        unit = labels(instance).distance
        first, second = (heading("xyz"[axis], unit) for axis in plane)
        tasks, starts, homes = (every[:, list(plane)] for every in _positions(instance))
        return Places(tasks, starts, 1.0, (first, second), homes)
    tasks, starts, homes = (every[:, :2].copy() for every in _positions(instance))
    both = np.vstack([tasks, starts, homes])
    known = both[~np.isnan(both[:, 0])]
    if len(known) and np.ptp(known[:, 0] % 360) < np.ptp(known[:, 0]):  # on both sides of the date line
        for every in (tasks, starts, homes):
            every[:, 0] %= 360
    middle = (known[:, 1].min() + known[:, 1].max()) / 2 if len(known) else 0.0
    aspect = 1 / max(float(np.cos(np.radians(middle))), STEEPEST)
    return Places(tasks, starts, aspect, ("longitude (°)", "latitude (°)"), homes)


def _positions(instance: Instance) -> tuple[FloatArray, FloatArray, FloatArray]:
    return instance.task_position, instance.start_position, instance.bases.position


def two_axes(instance: Instance) -> tuple[int, int]:
    """Return the two axes with the largest spread of positions, in the order x, y, z."""
    both = np.vstack(_positions(instance))
    known = both[~np.isnan(both[:, 0])]
    spread = np.ptp(known, axis=0) if len(known) else np.zeros(3)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


@dataclass(frozen=True, eq=False)
class Base:
    """A place where agents start, or to which they return.

    Attributes
    ----------
    name : str
        Id of the base or of the task at this place, id of the only agent, or common prefix of the agents' ids.
    place : ndarray, shape (2,)
        Position on the map.
    agents : ndarray of int
        Agents that start there.
    task : int or None
        Task at the same position.
    is_named : bool
        Whether the name is more than a number.
    """

    name: str
    place: FloatArray
    agents: IntArray
    task: int | None
    is_named: bool


def bases(instance: Instance, where: Places, most: int = MAX_BASES) -> list[Base]:
    """Return the places where agents start, at most `most` evenly sampled ones, and the other bases to return to.

    Agents whose position is unknown are left out.
    """
    known = np.flatnonzero(~np.isnan(where.starts[:, 0]))
    begin = _starts(instance, where, known, most) if len(known) else []
    taken = {tuple(base.place.tolist()) for base in begin}
    used = np.unique(instance.return_base[instance.return_base >= 0]).tolist()
    more = [b for b in used if not np.isnan(where.homes[b, 0]) and tuple(where.homes[b].tolist()) not in taken]
    nobody = np.zeros(0, dtype=np.intp)
    return begin + [Base(instance.bases.ids[b], where.homes[b], nobody, None, is_named=True) for b in more]


def _starts(instance: Instance, where: Places, known: IntArray, most: int) -> list[Base]:
    place, group = np.unique(where.starts[known], axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    first = np.searchsorted(group.ravel()[order], np.arange(len(place) + 1))
    kept = np.unique(np.linspace(0, len(place) - 1, min(len(place), most)).astype(np.intp)).tolist()
    members = [known[order[first[k] : first[k + 1]]] for k in kept]
    task_at = {tuple(row): j for j, row in reversed(list(enumerate(where.tasks.tolist())))}
    tasks = [task_at.get(tuple(row)) for row in place[kept].tolist()]
    own = {tuple(row): name for name, row in zip(instance.bases.ids, where.homes.tolist(), strict=True)}
    names = _names(instance, members, tasks)
    names = [own.get(tuple(row), name) for name, row in zip(names, place[kept].tolist(), strict=True)]
    count = Counter(names)
    found = []
    for k, (name, agents, task) in enumerate(zip(names, members, tasks, strict=True)):
        is_named = bool(name) and count[name] == 1
        shown = name if is_named else f"base {k + 1}" if len(kept) > 1 else "base"
        found.append(Base(shown, place[kept[k]], agents, task, is_named))
    return found


def _names(instance: Instance, members: list[IntArray], tasks: list[int | None]) -> list[str]:
    """Return the name of each base; empty if none can be derived from the ids of its agents."""
    everybody = _common_prefix(list(instance.agent_ids))
    names = []
    for agents, task in zip(members, tasks, strict=True):
        ids = [instance.agent_ids[i] for i in agents.tolist()]
        shared = "" if len(members) > 1 and _common_prefix(ids) == everybody else _common_prefix(ids)
        names.append(instance.task_ids[task] if task is not None else ids[0] if len(ids) == 1 else shared)
    return names


def _common_prefix(ids: list[str]) -> str:
    """Return the common prefix of all ids without trailing digits and separators; empty if shorter than two."""
    first, last = min(ids), max(ids)
    length = next((k for k, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    shared = first[:length].rstrip("0123456789-_ .:/#")
    return shared if len(shared) > 1 else ""
