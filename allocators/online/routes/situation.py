"""Input of route planning: agents and tasks at an hour, and known future events, as arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

EUCLIDEAN, MANHATTAN, FIXED = 0, 1, 2
"""How agents are diverted in flight: anywhere along a path in this metric, or (`FIXED`) only at its end."""

OUT, IN, CHARGED, OPENS, CHANGED, CANCELLED = range(6)
"""Kinds of known future events: an agent leaves, joins, is recharged; a task opens, changes, is cancelled."""


AGENT = np.dtype(
    [
        *((name, np.float64) for name in ("ability", "speed", "consumption", "reach", "battery", "free")),
        *((name, np.int64) for name in ("active", "at", "aim")),
    ]
)
"""Ability, speed, energy per distance, range, energy left, and the hour from which the agent can fly; whether it is in
the mission, the task where it works, and the task to which it flies or where it works, -1 for none."""

TASK = np.dtype(
    [
        *((name, np.float64) for name in ("left", "growth", "weight", "deadline", "appears")),
        *((name, np.int64) for name in ("is_open", "begun")),
    ]
)

EVENT = np.dtype([("hour", np.float64), ("amount", np.float64), ("kind", np.int64), ("index", np.int64)])


class Situation(NamedTuple):
    """`n` agents and `m` tasks at an hour. Records are used because compiled calls with few arrays are faster.

    Attributes
    ----------
    hour, end : float
        The present hour, and the end of the mission.
    agents, tasks, events : ndarray of `AGENT`, `TASK` and `EVENT`
        Known future events are sorted by hour.
    allowed : ndarray of bool, shape (n, m)
        Which agents may work at which tasks, skills included.
    start_distance : ndarray, shape (n, m)
        Distances from the agents' present places to tasks.
    distance : ndarray, shape (m, m)
        Distances between tasks.
    home : ndarray, shape (m, n)
        Distances from each task back home, for agents that return; 0 for others.
    place, site : ndarray, shape (n, 3) and (m, 3)
    metric : int
        `EUCLIDEAN`, `MANHATTAN` or `FIXED`.
    pace : float
        Work of a group per hour over its ability, on average.
    has_missed : bool
        Whether a deadline was already missed, so that hours to completion count instead of mission time.
    price : float
        Penalty of each switch, in units of `scale`.
    scale : float
        Hours that all work would take without flights: the unit of time in a plan's cost.
    """

    hour: float
    end: float
    agents: Records
    tasks: Records
    events: Records
    allowed: Bools
    start_distance: Floats
    distance: Floats
    home: Floats
    place: Floats
    site: Floats
    metric: int
    pace: float
    has_missed: bool
    price: float
    scale: float


def records(kind: np.dtype[np.void], size: int, **columns: ArrayLike) -> Records:
    """Return records with these columns; all other fields are 0."""
    table = np.zeros(size, kind)
    for name, values in columns.items():
        table[name] = values
    return table
