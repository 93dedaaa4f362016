"""An instance as plain arrays for compiled loops."""

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.reach import TOLERANCE, Reach
from alloc.problems.instance import FloatArray, Instance

Int32Array = NDArray[np.int32]
Array = TypeVar("Array", FloatArray, Int32Array)

TABLE_LIMIT = 2_000_000
"""Number of pairs of origin and task up to which distances are tabulated; with more, they are computed on demand."""

UNITS = (1.0, 0.5, 0.2, 0.1, 0.05, 0.01, 0.001)
"""Units in which abilities may be integers, largest first."""

LARGEST_INTEGER_SUM = 2.0**40
"""Sum of abilities, in units, up to which they are treated as integers."""


class InstanceArrays(NamedTuple):
    """The constant data of a search. An origin is a starting location with its limits, shared by one or more agents.

    Attributes
    ----------
    ability : ndarray, shape (n,)
        Work per hour, in `ability_unit`.
    hours_per_distance : ndarray, shape (n,)
        Reciprocal of the speed.
    origin : ndarray of int, shape (n,)
        Origin of each agent.
    distance : ndarray, shape (origins, m) or (0, 0)
        Distances, ``inf`` if a task is out of reach; empty if there are more than `TABLE_LIMIT`.
    cost : ndarray, as `distance`
        Costs, see `Reach.costs`; the same array if costs are distances.
    origin_position, task_position : ndarray, shape (origins, 3) and (m, 3)
        Coordinates; unknown ones are NaN.
    longest_distance, battery : ndarray, shape (origins,)
        Limits on distance and on energy, including a tolerance.
    list_begin, listed_task : ndarray of int, shape (origins + 1,) and (total,)
        Sorted tasks that agents of each origin may do, as a compressed sparse row; an empty row allows all tasks.
    listed_distance, listed_cost : ndarray, shape (total,) or (0,)
        Distances and costs of these tasks, which are all within reach; empty if coordinates determine them.
    energy_per_distance, ability_unit : float
    integer_ability : bool
        Whether all abilities are integers in `ability_unit`, and travel takes no time.
    instant_travel : bool
        Whether travel takes no time.
    """

    ability: FloatArray
    hours_per_distance: FloatArray
    origin: Int32Array
    distance: FloatArray
    cost: FloatArray
    origin_position: FloatArray
    task_position: FloatArray
    longest_distance: FloatArray
    battery: FloatArray
    list_begin: NDArray[np.int64]
    listed_task: Int32Array
    listed_distance: FloatArray
    listed_cost: FloatArray
    energy_per_distance: float
    ability_unit: float
    integer_ability: bool
    instant_travel: bool


def instance_arrays(instance: Instance) -> InstanceArrays:
    """Return the arrays of `instance`, with an empty table of distances."""
    reach = instance.reach
    list_begin, listed_task, listed_distance, listed_cost = _lists(reach)
    unit = None if instance.has_travel_time else _common_unit(instance.ability)
    scale = float(np.mean(instance.ability)) if unit is None else unit
    scaled = instance.ability / scale
    return InstanceArrays(
        ability=np.ascontiguousarray(scaled if unit is None else np.round(scaled)),
        hours_per_distance=1.0 / instance.speed,
        origin=reach.origin.astype(np.int32),
        distance=np.zeros((0, 0)),
        cost=np.zeros((0, 0)),
        origin_position=_read_only(np.ascontiguousarray(reach.place)),
        task_position=_read_only(np.ascontiguousarray(reach.goal)),
        longest_distance=reach.communication_range + TOLERANCE,
        battery=reach.battery + TOLERANCE,
        list_begin=list_begin,
        listed_task=_read_only(listed_task),
        listed_distance=_read_only(listed_distance),
        listed_cost=_read_only(listed_cost),
        energy_per_distance=reach.energy_per_distance,
        ability_unit=scale,
        integer_ability=unit is not None,
        instant_travel=not instance.has_travel_time,
    )


def _read_only(array: Array) -> Array:
    """Return a read-only view of an array, as the arrays of an instance and of its neighbours are read-only.

    To numba, writable arrays have another type, for which it would compile all loops again during a run.
    """
    view = array.view()
    view.flags.writeable = False
    return view


def _lists(reach: Reach) -> tuple[NDArray[np.int64], Int32Array, FloatArray, FloatArray]:
    """Return the lists of tasks by origin, with distances and costs unless coordinates determine them."""
    none = np.zeros(0)
    if reach.is_plain or len(reach.place) * len(reach.goal) <= TABLE_LIMIT:
        return (*_task_lists(reach), none, none)
    near = reach.neighbours
    assert near is not None, "an instance with too many pairs is refused"
    cost = reach.costs(near.origin.astype(np.intp), near.task.astype(np.intp), near.distance)
    rows = np.diff(near.first)
    if (rows > 0).all():
        return near.first.astype(np.int64), near.task, near.distance, cost
    # a row without tasks gets the task m, which does not exist
    at = near.first[:-1][rows == 0]
    begin = near.first + np.concatenate([[0], np.cumsum(rows == 0)])
    return begin, *(
        np.insert(part, at, value) for part, value in ((near.task, len(reach.goal)), (near.distance, 0), (cost, 0))
    )


def _task_lists(reach: Reach) -> tuple[NDArray[np.int64], Int32Array]:
    """Return the concatenated lists of tasks by origin; a list without tasks gets the task m, which does not exist."""
    if not len(reach.lists):
        return np.zeros(len(reach.place) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32)
    no_task, any_task = np.array([len(reach.goal)]), np.zeros(0, dtype=np.intp)
    lists = [row if len(row) else no_task for row in reach.lists]
    rows = [lists[number] if number >= 0 else any_task for number in reach.list_of.tolist()]
    begin = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
    return begin, np.concatenate(rows).astype(np.int32)


def _common_unit(ability: FloatArray) -> float | None:
    """Return the largest unit, a multiple of one of `UNITS`, in which all abilities are integers, or None."""
    for unit in UNITS:
        multiple = ability / unit
        integer = np.round(multiple)
        is_small = integer.min() >= 1 and integer.sum() < LARGEST_INTEGER_SUM
        if is_small and (np.abs(multiple - integer) <= 1e-9 * integer).all():
            return float(np.gcd.reduce(integer.astype(np.int64))) * unit
    return None
