"""Where to look around: the place that is near, and was not seen for long by anybody, as far as an agent knows."""

import math

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.missions.chance import first_key, fraction, keyed
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import FloatArray

CELLS = 8
"""Cells of the area along two axes, of each of which an agent remembers when it was last seen."""

BATTERY_SHARE = 0.25
"""Part of its battery that an agent spends on one flight without a task at the most."""

SPREAD = 0.3
"""Part of the choice that is chance, so that agents who know the same go different ways."""

EXPLORING = 11
"""What chances are for, as `alloc.problems.missions.chance` counts."""


@compiled
def centre(area: FloatArray, cell: int) -> tuple[float, float, float]:
    """Return the centre of a cell; `area` has the least and the largest coordinates in two rows."""
    x, y = (cell % CELLS + 0.5) / CELLS, (cell // CELLS + 0.5) / CELLS
    low, high = area[0], area[1]
    return low[0] + x * (high[0] - low[0]), low[1] + y * (high[1] - low[1]), 0.5 * (low[2] + high[2])


@compiled
def notice(area: FloatArray, sensing: float, x: float, y: float, hour: float, seen: FloatArray) -> None:
    """Note that all within the sensing radius of a place was seen at an hour; `seen` has one hour for each cell."""
    wide, deep = (area[1, 0] - area[0, 0]) / CELLS, (area[1, 1] - area[0, 1]) / CELLS
    for row in range(CELLS):
        dy = area[0, 1] + (row + 0.5) * deep - y
        if dy * dy <= sensing * sensing:
            for column in range(CELLS):
                dx = area[0, 0] + (column + 0.5) * wide - x
                if dx * dx + dy * dy <= sensing * sensing:
                    seen[row * CELLS + column] = max(seen[row * CELLS + column], hour)


@compiled
def find_unseen(
    situation: Situation,
    area: FloatArray,
    sensing: float,
    seen: FloatArray,
    seed: int,
    number: int,
    goal: int,
    look: FloatArray,
) -> int:
    """Fill in how far off and how long unseen the best cell to fly to is; return its number, -1 if there is none.

    Parameters
    ----------
    situation : Situation
    area : ndarray, shape (2, 3)
    sensing : float
    seen : ndarray, shape (cells,)
    seed, number : int
        Of the run, and of the agent.
    goal : int
        Cell to which it is on its way, which it keeps to; -1 for none.
    look : ndarray, shape (3,)
        See `fill_options`.
    """
    own, last = situation.own, seen.copy()
    for i in range(len(situation.counts)):
        if situation.counts[i]:
            at = situation.other[known.OTHER_X, i], situation.other[known.OTHER_Y, i]
            notice(area, sensing, at[0], at[1], own[known.HOUR] - 1e-3, last)
    look[0] = 0.0
    if goal >= 0:
        rate_cell(own, area, last, goal // CELLS, goal % CELLS, look)
        return goal
    key = keyed(keyed(first_key(EXPLORING), seed), number)
    rated = np.zeros(3)
    best, found = -np.inf, -1
    for row in range(CELLS):
        for column in range(CELLS):
            way = rate_cell(own, area, last, row, column, rated)
            value = rated[2] - rated[1] + SPREAD * fraction(keyed(key, row * CELLS + column))
            is_cheap = own[known.ENERGY_PER_DISTANCE] * way <= BATTERY_SHARE * own[known.BATTERY]
            if value > best and is_cheap:
                best, found = value, row * CELLS + column
                look[:] = rated
    return found


@compiled
def rate_cell(own: FloatArray, area: FloatArray, last: FloatArray, row: int, column: int, look: FloatArray) -> float:
    """Fill in how far off and how long unseen a cell is; return the length of the way."""
    low, high = area[0], area[1]
    x = low[0] + (column + 0.5) / CELLS * (high[0] - low[0])
    y = low[1] + (row + 0.5) / CELLS * (high[1] - low[1])
    dx, dy, dz = x - own[known.X], y - own[known.Y], 0.5 * (low[2] + high[2]) - own[known.Z]
    way = math.sqrt(dx * dx + dy * dy + dz * dz)
    seen = last[row * CELLS + column]
    scale = max(own[known.SPAN] / own[known.SPEED], 1e-9)
    look[0], look[1] = 1.0, way / max(own[known.SPAN], 1e-9)
    look[2] = min(1.0, (own[known.HOUR] - seen) / scale) if seen >= 0 else 1.0
    return way
