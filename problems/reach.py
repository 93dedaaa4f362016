"""Reach: which tasks an agent can take (C(i) of the paper) and how far it flies to them (1).

Agents that start at one place with the same range, battery and list of tasks share one row: their *origin*. Paper
instances have as many origins as tasks, whatever the number of agents.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from alloc.problems.instance import Instance

TOLERANCE = 1e-9
"""Slack on ranges (in distance) and batteries (in energy)."""

LARGEST = 1e150
"""Coordinates beyond are scaled before distances are measured."""

BLOCK = 1 << 16
"""Distances that are worked out together."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Reachable tasks and distances per origin.

    Attributes
    ----------
    origin : ndarray of int, shape (n,)
        Row of each agent in the other two.
    distance : ndarray of float, shape (origins, m)
        Distance from the origin to each task, 0 where either place is unknown (1).
    mask : ndarray of bool, shape (origins, m)
        Whether the task is in C(i): allowed, within range, and within the battery.
    """

    origin: NDArray[np.intp]
    distance: NDArray[np.float64]
    mask: NDArray[np.bool_]

    @property
    def is_complete(self) -> bool:
        """Whether every agent can take every task."""
        return bool(self.mask.all())

    def allows(self, agent: NDArray[np.intp], task: NDArray[np.intp]) -> NDArray[np.bool_]:
        """Whether each of the agents can take the task beside it; both of shape (k,), and so is the answer."""
        return self.mask[self.origin[agent], task]

    def distance_of(self, agent: NDArray[np.intp], task: NDArray[np.intp]) -> NDArray[np.float64]:
        """Distance from each agent's start to the task beside it; both of shape (k,), and so is the answer."""
        return self.distance[self.origin[agent], task]


def build_reach(instance: Instance) -> Reach:
    """Group the agents of `instance` by origin and measure the tasks from each.

    Takes O(n log n + origins * m) time and O(n + origins * m) memory.
    """
    lists = _list_numbers(instance)
    keys = np.column_stack([instance.start_position, instance.communication_range, instance.battery, lists])
    first, origin = _unique_rows(keys)
    distance = _distances(instance.start_position[first], instance.task_position)
    mask = distance <= instance.communication_range[first, None] + TOLERANCE
    if np.isfinite(instance.battery).any():
        with np.errstate(over="ignore"):
            mask &= instance.energy_per_distance * distance <= instance.battery[first, None] + TOLERANCE
    if instance.allowed_tasks is not None:
        for row, agent in enumerate(first.tolist()):
            allowed = instance.allowed_tasks[agent]
            if allowed is not None:
                reached = mask[row, allowed]
                mask[row] = False
                mask[row, allowed] = reached
    for array in (origin, distance, mask):
        array.setflags(write=False)
    return Reach(origin, distance, mask)


def _distances(place: NDArray[np.float64], goal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Euclidean distances, shape (places, goals), 0 where a coordinate is NaN; in blocks that fit a cache."""
    farthest = max(np.nanmax(np.abs(places), initial=0.0) for places in (place, goal))
    if farthest > LARGEST:  # its square is more than a float holds
        with np.errstate(over="ignore"):
            far: NDArray[np.float64] = _distances(place / farthest, goal / farthest) * farthest
        return np.minimum(far, np.finfo(float).max)
    distance = np.zeros((len(place), len(goal)))
    rows = max(1, BLOCK // len(goal))
    for first in range(0, len(place), rows):
        block = distance[first : first + rows]
        for axis in range(place.shape[1]):
            step = np.subtract.outer(place[first : first + rows, axis], goal[:, axis])
            block += np.multiply(step, step, out=step)
        np.sqrt(block, out=block)
    distance[np.isnan(place).any(axis=1)] = 0.0
    distance[:, np.isnan(goal).any(axis=1)] = 0.0
    return distance


def _list_numbers(instance: Instance) -> NDArray[np.float64]:
    """Number the distinct lists of allowed tasks; 0 means all."""
    if instance.allowed_tasks is None:
        return np.zeros(instance.n)
    numbers: dict[bytes, int] = {}
    keys = [b"all" if entry is None else b"list" + entry.tobytes() for entry in instance.allowed_tasks]
    return np.array([0 if key == b"all" else numbers.setdefault(key, len(numbers) + 1) for key in keys], dtype=float)


def _unique_rows(keys: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first index of each distinct row and the number of each row's kind; NaN equals NaN here."""
    plain = np.where(np.isnan(keys), np.inf, keys) + 0.0  # + 0.0 turns -0.0 into 0.0
    flags = np.isnan(keys).any(axis=1).astype(float)
    rows = np.ascontiguousarray(np.column_stack([plain, flags]))
    packed = rows.view(np.dtype((np.void, rows.dtype.itemsize * rows.shape[1])))[:, 0]
    _, first, kind = np.unique(packed, return_index=True, return_inverse=True)
    return first.astype(np.intp), kind.astype(np.intp).reshape(-1)
