"""Search for agents within a radius by a grid of cells, compiled.

The grid holds the agents' places at some hour. Later, the search radius is increased by the distance that the fastest
agent may have flown since.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.layout import Numbers
from alloc.allocators.missions.motion import Point, place_of
from alloc.allocators.missions.records import Agent, Head
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.missions.mission import Mission

FEW = 100
"""Number of agents up to which all are examined, without a grid."""

SLACK = 1e-6
"""Relative increase of the distance that an agent may have flown, to allow for rounding errors."""


def divide(mission: Mission, head: NDArray[np.void]) -> Numbers:
    """Describe the grid in the head, and return its array of cells; one cell for few agents, or unknown places."""
    places = [mission.instance.start_position, mission.instance.task_position, mission.instance.bases.position]
    low, high = np.array(mission.area)[:, :2]
    n, width = mission.instance.n, float((high - low).max())
    side = max(min(mission.sensing, mission.radio.radius), width / math.sqrt(n))
    columns = rows = 1
    if n > FEW and 0 < side < width and all(np.isfinite(some).all() for some in places):
        columns, rows = (max(1, math.ceil(float(extent) / side)) for extent in high - low)
    head["left"], head["low"], head["side"] = low[0], low[1], side if columns * rows > 1 else -1.0
    head["columns"], head["rows"] = columns, rows
    head["fastest"], head["located"] = mission.instance.speed.max(initial=0.0), -np.inf
    return np.array([0] * (columns * rows) + [n], np.int32)


Found = tuple[BoolArray, Numbers]
"""Output arrays of a search: `is_near` and `near` of `MissionArrays`."""


@inlined
def drift(head: Head) -> float:
    """Return how far an agent may be from its place in the grid; NaN or infinite if the grid is not usable."""
    return head.fastest * (head.hour - head.located) * (1 + SLACK)


@compiled_in_place
def cell_along(value: float, begin: float, side: float, count: int) -> int:
    """Return the column or row of a coordinate, clipped to the grid."""
    return 0 if count == 1 else int(min(max((value - begin) / side, 0.0), count - 1.0))


@inlined
def cells_near(head: Head, x: float, y: float, reach: float) -> tuple[int, int, int, int]:
    """Return the first and last column, and the first and last row, that may contain agents within `reach`."""
    first = cell_along(x - reach, head.left, head.side, head.columns)
    last = cell_along(x + reach, head.left, head.side, head.columns)
    low = cell_along(y - reach, head.low, head.side, head.rows)
    return first, last, low, cell_along(y + reach, head.low, head.side, head.rows)


@compiled_in_place
def locate(head: Head, agents: Sequence[Agent], places: FloatArray, cells: Numbers, in_cells: Numbers) -> None:
    """Fill the grid with the present places of all agents."""
    head.located = head.hour
    if len(cells) == 2:
        for number in range(len(agents)):
            places[0, number], places[1, number], places[2, number] = place_of(agents[number], head.hour)
        return
    cells[:] = 0
    for number in range(len(agents)):
        cells[cell_of(head, place_of(agents[number], head.hour)) + 1] += 1
    for cell in range(1, len(cells)):
        cells[cell] += cells[cell - 1]
    for number in range(len(agents) - 1, -1, -1):
        here = place_of(agents[number], head.hour)
        cell = cell_of(head, here)
        cells[cell + 1] -= 1
        place = cells[cell + 1]
        in_cells[place] = number
        places[0, place], places[1, place], places[2, place] = here
    for cell in range(1, len(cells) - 1):
        cells[cell] = cells[cell + 1]
    cells[len(cells) - 1] = len(agents)


@compiled_in_place
def cell_of(head: Head, place: Point) -> int:
    """Return the cell of a place."""
    column = cell_along(place[0], head.left, head.side, head.columns)
    return cell_along(place[1], head.low, head.side, head.rows) * head.columns + column


@compiled_in_place
def limit_of(is_manhattan: int, reach: float) -> float:
    """Return the largest `comparable_length` of a difference vector that is not longer than `reach`.

    A square root is rounded, so the square of `reach` may be off by a rounding error.
    """
    if is_manhattan or not reach < np.inf:
        return reach
    limit = reach * reach
    while math.sqrt(limit) > reach:
        limit = np.nextafter(limit, 0.0)
    while math.sqrt(np.nextafter(limit, np.inf)) <= reach:
        limit = np.nextafter(limit, np.inf)
    return limit


@inlined
def find_within(
    is_manhattan: int, limit: float, to: Point, places: FloatArray, begin: int, end: int, output: Found
) -> int:
    """Find the places that are within reach of a point, or unknown; return their number.

    Parameters
    ----------
    is_manhattan : int
    limit : float
        The reach, by `limit_of`.
    to : tuple of float
    places : ndarray, shape (3, places)
    begin, end : int
        Range of the places to examine.
    output : Found
        A workspace, and the indices of the places found.
    """
    is_near, near = output
    at_x, at_y, at_z = places[0, begin:end], places[1, begin:end], places[2, begin:end]
    x, y, z = to
    for place in range(end - begin):  # from 0, so that the loop is vectorised
        is_near[place] = not comparable_length(is_manhattan, at_x[place] - x, at_y[place] - y, at_z[place] - z) > limit
    found = 0
    for place in range(end - begin):
        near[found] = begin + place
        found += is_near[place]
    return found


@inlined
def comparable_length(is_manhattan: int, dx: float, dy: float, dz: float) -> float:
    """Return the length of a difference vector, squared if it is Euclidean; NaN if it has unknown coordinates."""
    return abs(dx) + abs(dy) + abs(dz) if is_manhattan else dx * dx + dy * dy + dz * dz


@compiled_in_place
def sort(numbers: IntArray, begin: int, count: int) -> None:
    """Sort a part of an array by Shell sort."""
    gap = count // 2
    while gap > 0:
        for place in range(begin + gap, begin + count):
            number, at = numbers[place], place
            while at >= begin + gap and numbers[at - gap] > number:
                numbers[at] = numbers[at - gap]
                at -= gap
            numbers[at] = number
        gap //= 2
