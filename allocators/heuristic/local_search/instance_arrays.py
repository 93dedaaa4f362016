"""What the compiled loops know of an instance: abilities, places and limits, as plain arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.reach import TOLERANCE, Reach
from alloc.problems.instance import FloatArray, Instance

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
    instant : bool
        Whether travel takes no time.
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
    instant: bool


def survey(instance: Instance) -> Ground:
    """Gather what is needed of `instance`, without distances yet."""
    reach = instance.reach
    first, listed = _lists(reach)
    unit = None if instance.has_travel_time else _unit(instance.ability)
    step = float(np.mean(instance.ability)) if unit is None else unit
    return Ground(
        ability=np.ascontiguousarray(instance.ability / step if unit is None else np.round(instance.ability / step)),
        slow=1.0 / instance.speed,
        origin=reach.origin.astype(np.int32),
        table=np.zeros((0, 0)),
        place=np.ascontiguousarray(reach.place),
        goal=np.ascontiguousarray(reach.goal),
        farthest=reach.communication_range + TOLERANCE,
        battery=reach.battery + TOLERANCE,
        first=first,
        listed=listed,
        scale=1.0,
        energy_per_distance=reach.energy_per_distance,
        unit=step,
        whole=unit is not None,
        instant=not instance.has_travel_time,
    )


def _lists(reach: Reach) -> tuple[NDArray[np.int64], Small]:
    """Lists of tasks by origin, one behind the other; an agent that may do nothing gets a task that there is not."""
    if not len(reach.lists):
        return np.zeros(len(reach.place) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32)
    nowhere, everywhere = np.array([len(reach.goal)]), np.zeros(0, dtype=np.intp)
    lists = [row if len(row) else nowhere for row in reach.lists]
    rows = [lists[number] if number >= 0 else everywhere for number in reach.list_of.tolist()]
    first = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    return first, np.concatenate(rows).astype(np.int32)


def _unit(ability: FloatArray) -> float | None:
    """Return the largest step at hand of which all abilities are multiples, or None."""
    for step in UNITS:
        steps = ability / step
        whole = np.round(steps)
        if whole.min() >= 1 and whole.sum() < LARGEST_WHOLE and (np.abs(steps - whole) <= 1e-9 * whole).all():
            return float(np.gcd.reduce(whole.astype(np.int64))) * step
    return None
