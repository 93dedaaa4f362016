"""Positions of labels beside circles, without overlaps."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import FloatArray

Box = tuple[float, float, float, float]

SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (0.75, 0.75), (-0.75, 0.75), (0.75, -0.75), (-0.75, -0.75))
"""Above, below, right, left, and between."""

GAPS = (0.0, 9.0)
"""Points between a circle and its label."""


def place_labels(centre: FloatArray, radius: FloatArray, width: FloatArray, height: float) -> FloatArray:
    """Return the centre of each label, NaN where there is no room for it; the largest circles are labelled first.

    Parameters
    ----------
    centre : ndarray, shape (k, 2)
        Of the circles, in points; NaN rows have no circle.
    radius, width : ndarray, shape (k,)
        Of the circles, and of their labels, in points.
    height : float
        Of every label, in points.
    """
    middle = np.full((len(centre), 2), np.nan)
    taken: list[Box] = []
    for j in np.argsort(-radius, kind="stable"):
        if np.isnan(centre[j]).any():
            continue
        for gap, (across, up) in product(GAPS, SIDES):
            offset = np.array([across * (radius[j] + width[j] / 2 + 2 + gap), up * (radius[j] + height / 2 + 1 + gap)])
            box = _box(centre[j] + offset, width[j], height)
            if not any(_overlap(box, other) for other in taken) and not _touches(box, centre, radius).any():
                middle[j] = centre[j] + offset
                taken.append(box)
                break
    return middle


def visible(centre: FloatArray, radius: FloatArray, room: float) -> NDArray[np.bool_]:
    """Return whether each centre is free: no smaller circle, drawn on top, comes within `room` points of it."""
    distance = np.hypot(*(centre[:, None, :] - centre[None, :, :]).transpose(2, 0, 1))
    rank = np.empty(len(radius), dtype=int)
    rank[np.argsort(-radius, kind="stable")] = np.arange(len(radius))
    covered = (distance < radius[None, :] + room) & (rank[None, :] > rank[:, None])
    free: NDArray[np.bool_] = ~covered.any(axis=1)
    return free


def _box(middle: FloatArray, width: float, height: float) -> Box:
    x, y = middle.tolist()
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def _overlap(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def _touches(box: Box, centre: FloatArray, radius: FloatArray) -> NDArray[np.bool_]:
    """Return which circles the box touches."""
    nearest = np.clip(centre, [box[0], box[1]], [box[2], box[3]])
    touched: NDArray[np.bool_] = np.hypot(*(centre - nearest).T) < radius
    return touched
