"""Exploration: the choice of a near place that, to an agent's knowledge, no agent has seen for long."""

import math

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.missions.chance import first_key, fraction, keyed
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import FloatArray

CELLS = 8
"""Number of cells of the area along two axes; an agent remembers when each cell was last seen."""

BATTERY_SHARE = 0.25
"""Maximum share of its battery that an agent spends on a flight without a task."""

SPREAD = 0.3
"""Random share of the rating, so that agents with the same knowledge explore different places."""

EXPLORING = 11
"""Purpose of the random numbers, see `alloc.problems.missions.chance`."""


@compiled_in_place
def centre(area: FloatArray, cell: int) -> tuple[float, float, float]:
    """Return the centre of a cell; `area` has the least and the largest coordinates in two rows."""
    x, y = (cell % CELLS + 0.5) / CELLS, (cell // CELLS + 0.5) / CELLS
    low, high = area[0], area[1]
    return low[0] + x * (high[0] - low[0]), low[1] + y * (high[1] - low[1]), 0.5 * (low[2] + high[2])


@compiled_in_place
def record_seen(area: FloatArray, sensing: float, x: float, y: float, hour: float, seen: FloatArray) -> None:
    """Record that all cells within the sensing radius of a place were seen at an hour; `seen` has an hour per cell."""
    left, low = area[0, 0], area[0, 1]
    wide, deep = (area[1, 0] - left) / CELLS, (area[1, 1] - low) / CELLS
    reach = sensing * sensing
    for cell in range(CELLS * CELLS):
        dx = left + (cell % CELLS + 0.5) * wide - x
        dy = low + (cell // CELLS + 0.5) * deep - y
        if (dx * dx + dy * dy <= reach) & (seen[cell] < hour):
            seen[cell] = hour


@compiled_in_place
def find_unseen(
    situation: Situation,
    area: FloatArray,
    sensing: float,
    last: FloatArray,
    seed: int,
    number: int,
    goal: int,
    look: FloatArray,
) -> int:
    """Write distance and time since last seen of the best cell to fly to; return its index, -1 if there is none.

    Parameters
    ----------
    situation : Situation
    area : ndarray, shape (2, 3)
    sensing : float
    last : ndarray, shape (2, cells)
        Hour at which the agent last saw each cell, updated with reports on other agents; and scratch.
    seed, number : int
        Seed of the run, and index of the agent.
    goal : int
        Cell to which the agent is already flying, which is kept; -1 for none.
    look : ndarray, shape (3,)
        See `fill_options`.
    """
    own, hours, values = situation.own, last[0], last[1]
    for i in range(situation.others[0]):
        if situation.counts[i]:
            at = situation.other[known.OTHER_X, i], situation.other[known.OTHER_Y, i]
            record_seen(area, sensing, at[0], at[1], own[known.HOUR] - 1e-3, hours)
    best, found = -np.inf, goal
    if goal < 0:
        key = keyed(keyed(first_key(EXPLORING), seed), number)
        for cell in range(CELLS * CELLS):  # without branches, so that the loop is vectorised
            way, age = rate_cell(own, area, hours[cell], cell)
            value = age - way / max(own[known.SPAN], 1e-9) + SPREAD * fraction(keyed(key, cell))
            is_cheap = own[known.ENERGY_PER_DISTANCE] * way <= BATTERY_SHARE * own[known.BATTERY]
            values[cell] = value if is_cheap else -np.inf
        for cell in range(CELLS * CELLS):
            if values[cell] > best:
                best, found = values[cell], cell
    look[0] = found >= 0
    if found >= 0:
        way, look[2] = rate_cell(own, area, hours[found], found)
        look[1] = way / max(own[known.SPAN], 1e-9)
    return found


@inlined
def rate_cell(own: FloatArray, area: FloatArray, last: float, cell: int) -> tuple[float, float]:
    """Return the distance of a cell, and the time since it was last seen, at hour `last`, scaled from 0 to 1."""
    x, y, z = centre(area, cell)
    dx, dy, dz = x - own[known.X], y - own[known.Y], z - own[known.Z]
    way = math.sqrt(dx * dx + dy * dy + dz * dz)
    scale = max(own[known.SPAN] / own[known.SPEED], 1e-9)
    age = min(1.0, (own[known.HOUR] - last) / scale)
    return way, age if last >= 0 else 1.0
