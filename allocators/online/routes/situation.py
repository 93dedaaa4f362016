"""What a plan of routes is made for: agents and tasks at an hour, and what is known to come, as arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Records = NDArray[np.void]

EUCLIDEAN, MANHATTAN, FIXED = 0, 1, 2
"""How agents may be diverted in flight: by a metric, or not before the end of their way."""

OUT, IN, CHARGED, OPENS, CHANGED, CANCELLED = range(6)
"""Kinds of events that a plan may know of: an agent leaves, comes, gains energy; a task opens, changes, is over."""


AGENT = np.dtype(
    [
        *((name, np.float64) for name in ("ability", "speed", "consumption", "reach", "battery", "free")),
        *((name, np.int64) for name in ("active", "at", "aim")),
    ]
)
"""Work and distance per hour, energy per distance, longest flight, energy, and the hour from which an agent can fly;
whether it is in the mission, the task where it works, and that to which it goes or where it works, -1 for none."""

TASK = np.dtype(
    [
        *((name, np.float64) for name in ("left", "growth", "weight", "deadline", "appears")),
        *((name, np.int64) for name in ("is_open", "begun")),
    ]
)

EVENT = np.dtype([("hour", np.float64), ("amount", np.float64), ("kind", np.int64), ("index", np.int64)])


class Situation(NamedTuple):
    """Agents and tasks at an hour; `n` agents, `m` tasks. Records, as compiled code passes on few arrays faster.

    Attributes
    ----------
    hour, end : float
        Now, and when the mission ends.
    agents, tasks, events : ndarray of `AGENT`, `TASK` and `EVENT`
        Events are those that are known to come, in the order of time.
    allowed : ndarray of bool, shape (n, m)
        Who may work where, skills included.
    start_distance : ndarray, shape (n, m)
        From where agents are.
    distance : ndarray, shape (m, m)
    home : ndarray, shape (m, n)
        Way back from each task for agents that return, 0 for others.
    place, site : ndarray, shape (n, 3) and (m, 3)
    metric : int
        `EUCLIDEAN`, `MANHATTAN` or `FIXED`.
    pace : float
        Work of a group per hour over its ability, on average.
    has_missed : bool
        Whether a deadline was missed already, so that hours count instead of mission time.
    price : float
        Of each switch, in units of `scale`.
    scale : float
        Hours that all work would take without flights: the unit of time of a plan's value.
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
    """Return records with these columns, whose other fields are 0."""
    table = np.zeros(size, kind)
    for name, values in columns.items():
        table[name] = values
    return table
