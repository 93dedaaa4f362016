"""What the compiled loops know of an instance: abilities, places and limits, as plain arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import FloatArray, Instance
from alloc.problems.reach import LARGEST, TOLERANCE

Small = NDArray[np.int32]

TABLE_LIMIT = 2_000_000
"""Pairs of origin and task up to which distances are kept; beyond, each is measured when it is asked for."""

UNITS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.01, 0.001)
"""Steps that abilities may come in, the largest first."""

LARGEST_WHOLE = 2.0**40
"""Sum of abilities, in steps, up to which sums of them are worked out over whole numbers."""


class Ground(NamedTuple):
    """The unchanging part of a search.

    Attributes
    ----------
    ability : ndarray, shape (n,)
        Work per hour, in `unit`.
    slow : ndarray, shape (n,)
        Hours per unit of distance.
    origin : ndarray of int, shape (n,)
        Row of each agent in what follows.
    table : ndarray, shape (origins, m) or (0, 0)
        Distances, ``inf`` where a task is out of reach; empty where there are too many.
    place, goal : ndarray, shape (origins, 3) and (m, 3)
        Coordinates, in `scale`; NaN where unknown.
    farthest, battery : ndarray, shape (origins,)
        Limits on distance and on energy, tolerance included.
    first, listed : ndarray of int, shape (origins + 1,) and (total,)
        Tasks that the agents of each origin may do, sorted; an origin without any may do all.
    scale, energy_per_distance, unit : float
    whole : bool
        Whether all abilities are whole numbers in `unit`, and travel takes no time.
    """

    ability: FloatArray
    slow: FloatArray
    origin: Small
    table: FloatArray
    place: FloatArray
    goal: FloatArray
    farthest: FloatArray
    battery: FloatArray
    first: NDArray[np.int64]
    listed: Small
    scale: float
    energy_per_distance: float
    unit: float
    whole: bool


def survey(instance: Instance) -> Ground:
    """Gather what is needed of `instance`, without distances yet."""
    origin = instance.reach.origin
    _, example = np.unique(origin, return_index=True)
    place, goal = instance.start_position[example], instance.task_position
    farthest = max(np.nanmax(np.abs(places), initial=0.0) for places in (place, goal))
    scale = float(farthest) if farthest > LARGEST else 1.0
    first, listed = _lists(instance, example)
    unit = None if instance.has_travel_time else _unit(instance.ability)
    step = float(np.mean(instance.ability)) if unit is None else unit
    return Ground(
        ability=np.ascontiguousarray(instance.ability / step if unit is None else np.round(instance.ability / step)),
        slow=1.0 / instance.speed,
        origin=origin.astype(np.int32),
        table=np.zeros((0, 0)),
        place=np.ascontiguousarray(place / scale),
        goal=np.ascontiguousarray(goal / scale),
        farthest=instance.communication_range[example] + TOLERANCE,
        battery=instance.battery[example] + TOLERANCE,
        first=first,
        listed=listed,
        scale=scale,
        energy_per_distance=instance.energy_per_distance,
        unit=step,
        whole=unit is not None,
    )


def _lists(instance: Instance, example: NDArray[np.intp]) -> tuple[NDArray[np.int64], Small]:
    """Lists of tasks by origin, one behind the other; an agent that may do nothing gets a task that there is not."""
    if instance.allowed_tasks is None:
        return np.zeros(len(example) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32)
    nowhere = np.array([instance.m])
    lists = [instance.allowed_tasks[agent] for agent in example.tolist()]
    rows = [np.zeros(0, dtype=np.intp) if row is None else row if len(row) else nowhere for row in lists]
    first = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    return first, np.concatenate([np.sort(row) for row in rows]).astype(np.int32)


def _unit(ability: FloatArray) -> float | None:
    """Return the largest step at hand of which all abilities are multiples, or None."""
    for step in UNITS:
        steps = ability / step
        whole = np.round(steps)
        if whole.min() >= 1 and whole.sum() < LARGEST_WHOLE and (np.abs(steps - whole) <= 1e-9 * whole).all():
            return float(np.gcd.reduce(whole.astype(np.int64))) * step
    return None
