"""Where tasks and agents are on a map, and the bases at which agents begin together or to which they return."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from alloc.problems import Instance
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.text import heading
from alloc.problems.units import labels
from alloc.problems.vocabulary import GEOGRAPHIC

STEEPEST = 0.05
"""Least cosine of a latitude by which a map is stretched."""

MOST_BASES = 20_000
"""Places beyond which a sample is shown: more would only overlap."""


@dataclass(frozen=True, eq=False)
class Places:
    """The places of an instance on a map.

    Attributes
    ----------
    tasks, starts : ndarray, shapes (m, 2) and (n, 2)
        NaN rows where unknown.
    aspect : float
        How long a unit of the vertical axis is drawn, over one of the horizontal axis.
    axes : (str, str)
        Names of the axes, with units.
    homes : ndarray, shape (bases, 2)
        Of the bases to which agents return; NaN rows where unknown.
    """

    tasks: FloatArray
    starts: FloatArray
    aspect: float
    axes: tuple[str, str]
    homes: FloatArray

    @property
    def known(self) -> FloatArray:
        """All places that are known, shape (k, 2)."""
        every = np.vstack([self.tasks, self.starts, self.homes])
        return every[~np.isnan(every[:, 0])]

    def home_of(self, instance: Instance, agents: IntArray) -> FloatArray:
        """Return where each of these agents returns to, shape (k, 2); NaN where it is its start, or nowhere."""
        return np.vstack([self.homes, [[np.nan, np.nan]]])[instance.return_base[agents]]


def places(instance: Instance) -> Places:
    """Return the places on a map: longitudes and latitudes, or the two axes along which the places spread the most."""
    if instance.metric != GEOGRAPHIC:
        plane = two_axes(instance)
        unit = labels(instance).distance
        first, second = (heading("xyz"[axis], unit) for axis in plane)
        tasks, starts, homes = (every[:, list(plane)] for every in _positions(instance))
        return Places(tasks, starts, 1.0, (first, second), homes)
    tasks, starts, homes = (every[:, :2].copy() for every in _positions(instance))
    both = np.vstack([tasks, starts, homes])
    known = both[~np.isnan(both[:, 0])]
    if len(known) and np.ptp(known[:, 0] % 360) < np.ptp(known[:, 0]):  # around the date line
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
    """A place where agents begin, or to which they return.

    Attributes
    ----------
    name : str
        Of the base or the task that is there, of the only agent, or what the ids of the agents begin with.
    place : ndarray, shape (2,)
        On the map.
    agents : ndarray of int
        Those who begin there.
    task : int or None
        The task that is there.
    is_named : bool
        Whether the name says more than a number.
    """

    name: str
    place: FloatArray
    agents: IntArray
    task: int | None
    is_named: bool


def bases(instance: Instance, where: Places, most: int = MOST_BASES) -> list[Base]:
    """Return where the agents begin, evenly spaced ones beyond `most`, and then where else they return to.

    Agents whose place is unknown are left out.
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
    """Return the name of each base, empty where the ids of its agents say nothing."""
    everybody = _beginning(list(instance.agent_ids))
    names = []
    for agents, task in zip(members, tasks, strict=True):
        ids = [instance.agent_ids[i] for i in agents.tolist()]
        shared = "" if len(members) > 1 and _beginning(ids) == everybody else _beginning(ids)
        names.append(instance.task_ids[task] if task is not None else ids[0] if len(ids) == 1 else shared)
    return names


def _beginning(ids: list[str]) -> str:
    """Return what all ids begin with, at least two characters, without numbers and separators at its end."""
    first, last = min(ids), max(ids)
    length = next((k for k, pair in enumerate(zip(first, last, strict=False)) if pair[0] != pair[1]), len(first))
    shared = first[:length].rstrip("0123456789-_ .:/#")
    return shared if len(shared) > 1 else ""
