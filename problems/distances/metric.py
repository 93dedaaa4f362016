"""Distances between places by a metric; blocks and single pairs give bitwise identical results."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BLOCK = 1 << 16
"""Number of distances computed together, such that they fit into a cache."""


def distances(place: Floats, goal: Floats) -> Floats:
    """Return Euclidean distances (1) between arrays of places, with broadcasting; 0 where a coordinate is NaN.

    Parameters
    ----------
    place, goal : ndarray, shape (..., 3)
    """
    total = np.square(place[..., 0] - goal[..., 0])
    for axis in range(1, place.shape[-1]):
        step = place[..., axis] - goal[..., axis]
        total += np.multiply(step, step, out=step)
    np.sqrt(total, out=total)
    unknown = np.isnan(total)
    if unknown.any():
        total[unknown] = 0.0
    return total


def manhattan_distances(place: Floats, goal: Floats) -> Floats:
    """Return Manhattan distances between arrays of places, with broadcasting; 0 where a coordinate is NaN.

    Parameters
    ----------
    place, goal : ndarray, shape (..., 3)
    """
    total = np.abs(place[..., 0] - goal[..., 0])
    for axis in range(1, place.shape[-1]):
        total += np.abs(place[..., axis] - goal[..., axis])
    total[np.isnan(total)] = 0.0
    return total


def distance_table(place: Floats, goal: Floats, between: Callable[[Floats, Floats], Floats] = distances) -> Floats:
    """Return the distances from all places to all goals, computed by `between`, shape (places, goals)."""
    table = np.empty((len(place), len(goal)))
    rows = max(1, BLOCK // len(goal))
    columns = np.ascontiguousarray(goal.T).T[None, :, :]
    for first in range(0, len(place), rows):
        block = slice(first, first + rows)
        table[block] = between(place[block, None, :], columns)
    return table
