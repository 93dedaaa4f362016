"""Placement of labels beside circles without overlaps."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from alloc.problems.instance import FloatArray

Box = tuple[float, float, float, float]

SIDES = ((0, 1), (0, -1), (1, 0), (-1, 0), (0.75, 0.75), (-0.75, 0.75), (0.75, -0.75), (-0.75, -0.75))
"""Directions from a circle to its label: above, below, right, left, and the diagonals."""

GAPS = (0.0, 9.0)
"""Distances between a circle and its label, in points."""


def place_labels(
    centre: FloatArray, radius: FloatArray, width: FloatArray, height: float, lines: FloatArray
) -> FloatArray:
    """Return the centre of each label, NaN if there is no room for it; the largest circles are labelled first.

    Of the positions without overlap, the first that is crossed by the fewest lines is chosen.

    Parameters
    ----------
    centre : ndarray, shape (k, 2)
        Centres of the circles, in points; NaN rows have no circle.
    radius, width : ndarray, shape (k,)
        Radii of the circles and widths of their labels, in points.
    height : float
        Height of every label, in points.
    lines : ndarray, shape (l, 2, 2)
        Both ends of each line, in points.
    """
    middle = np.full((len(centre), 2), np.nan)
    taken: list[Box] = []
    for j in np.argsort(-radius, kind="stable"):
        if np.isnan(centre[j]).any():
            continue
        best: tuple[int, Box] | None = None
        for gap, (across, up) in product(GAPS, SIDES):
            offset = np.array([across * (radius[j] + width[j] / 2 + 2 + gap), up * (radius[j] + height / 2 + 1 + gap)])
            box = _box(centre[j] + offset, width[j], height)
            if not any(_overlap(box, other) for other in taken) and not _touches(box, centre, radius).any():
                crossed = int(_crosses(box, lines).sum())
                if best is None or crossed < best[0]:
                    best, middle[j] = (crossed, box), centre[j] + offset
                if not crossed:
                    break
        if best is not None:
            taken.append(best[1])
    return middle


def visible(centre: FloatArray, radius: FloatArray, room: float) -> NDArray[np.bool_]:
    """Return for each centre whether no smaller circle, which is drawn on top, comes within `room` points of it."""
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


def _crosses(box: Box, lines: FloatArray) -> NDArray[np.bool_]:
    """Return which lines cross the box: those that are within its width and its height at the same time."""
    low, high = np.array(box[:2]), np.array(box[2:])
    begin, step = lines[:, 0], lines[:, 1] - lines[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(low - begin) / step, (high - begin) / step])
    ends[np.isnan(ends)] = 0.0  # a line exactly along the edge
    first, last = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    crossed: NDArray[np.bool_] = np.maximum(first, 0.0) < np.minimum(last, 1.0)
    return crossed


def _touches(box: Box, centre: FloatArray, radius: FloatArray) -> NDArray[np.bool_]:
    """Return which circles the box touches."""
    nearest = np.clip(centre, [box[0], box[1]], [box[2], box[3]])
    touched: NDArray[np.bool_] = np.hypot(*(centre - nearest).T) < radius
    return touched
