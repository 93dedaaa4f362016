"""Compiled distances from origins to tasks."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import InstanceArrays, Int32Array
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems.instance import FloatArray


@compiled
def listed_entry(list_begin: NDArray[np.int64], listed_task: Int32Array, origin: int, task: int) -> int:
    """Return the index of a task in the list of an origin, -1 if it is not listed."""
    low, high = list_begin[origin], list_begin[origin + 1]
    end = high
    while low < high:
        middle = (low + high) // 2
        if listed_task[middle] < task:
            low = middle + 1
        else:
            high = middle
    return low if low < end and listed_task[low] == task else -1


@compiled
def compute_distance(
    origin_position: FloatArray,
    task_position: FloatArray,
    longest_distance: FloatArray,
    battery: FloatArray,
    list_begin: NDArray[np.int64],
    listed_task: Int32Array,
    energy_per_distance: float,
    origin: int,
    task: int,
) -> float:
    """Return the distance from an origin to a task, ``inf`` if it is out of reach, bit for bit as `Reach` does.

    The arguments are single arrays, as passing `InstanceArrays` would cost more than the distance itself.
    """
    total = 0.0
    for axis in range(3):
        step = origin_position[origin, axis] - task_position[task, axis]
        total += step * step
    distance: float = np.sqrt(total)
    if np.isnan(distance):
        distance = 0.0
    distance = min(distance, 1.7976931348623157e308)
    if not distance <= longest_distance[origin] or not energy_per_distance * distance <= battery[origin]:
        return np.inf
    is_listed = list_begin[origin] == list_begin[origin + 1] or listed_entry(list_begin, listed_task, origin, task) >= 0
    return distance if is_listed else np.inf


@inlined
def untabulated_distance(arrays: InstanceArrays, origin: int, task: int) -> float:
    """Return the distance from an origin to a task without the table."""
    return compute_distance(
        arrays.origin_position,
        arrays.task_position,
        arrays.longest_distance,
        arrays.battery,
        arrays.list_begin,
        arrays.listed_task,
        arrays.energy_per_distance,
        origin,
        task,
    )


@inlined
def distance_and_cost(arrays: InstanceArrays, origin: int, task: int) -> tuple[float, float]:
    """Return the distance from an origin to a task, ``inf`` if it is out of reach, and the cost of the flight."""
    if arrays.distance.shape[0] > 0:
        return arrays.distance[origin, task], arrays.cost[origin, task]
    if arrays.listed_distance.shape[0] > 0:
        entry = listed_entry(arrays.list_begin, arrays.listed_task, origin, task)
        return (np.inf, np.inf) if entry < 0 else (arrays.listed_distance[entry], arrays.listed_cost[entry])
    distance = untabulated_distance(arrays, origin, task)
    return distance, distance


@compiled
def fill_table(arrays: InstanceArrays, distance: FloatArray) -> None:
    """Write all distances into `distance`, shape (origins, m)."""
    for origin in range(distance.shape[0]):
        for task in range(distance.shape[1]):
            distance[origin, task] = untabulated_distance(arrays, origin, task)


@compiled
def effective_ability(ability: float, hours_per_distance: float, makespan: float, distance: float) -> float:
    """Return what an agent contributes per hour of the makespan, reduced by the time that it travels."""
    if hours_per_distance == 0.0:
        return ability
    return ability * max(0.0, 1.0 - distance * hours_per_distance / makespan)
