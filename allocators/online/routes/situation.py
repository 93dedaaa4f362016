"""What a plan of routes is made for: agents and tasks at an hour, and what is known to come, as arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

EUCLIDEAN, MANHATTAN, FIXED = 0, 1, 2
"""How agents may be diverted in flight: by a metric, or not before the end of their way."""

OUT, IN, CHARGED, OPENS, CHANGED, CANCELLED = range(6)
"""Kinds of events that a plan may know of: an agent leaves, comes, gains energy; a task opens, changes, is over."""


class Situation(NamedTuple):
    """Agents and tasks at an hour; `n` agents, `m` tasks.

    Attributes
    ----------
    hour, end : float
        Now, and when the mission ends.
    ability, speed, consumption, reach, battery : ndarray, shape (n,)
        Work and distance per hour, energy per distance, longest flight, energy.
    free : ndarray, shape (n,)
        Hour from which each agent can fly from `place`.
    active : ndarray of bool, shape (n,)
        Whether it is in the mission now.
    at, aim : ndarray of int, shape (n,)
        Task where it works, and where it goes or works; -1 for none.
    left, growth, weight, deadline, appears : ndarray, shape (m,)
    is_open, begun : ndarray of bool, shape (m,)
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
    event_hour, event_amount : ndarray, shape (k,)
    event_kind, event_index : ndarray of int, shape (k,)
        What is known to come, in the order of time.
    has_missed : bool
        Whether a deadline was missed already, so that hours count instead of mission time.
    price : float
        Of each switch, in units of `scale`.
    scale : float
        Hours that all work would take without flights: the unit of time of a plan's value.
    """

    hour: float
    end: float
    ability: Floats
    speed: Floats
    consumption: Floats
    reach: Floats
    battery: Floats
    free: Floats
    active: Bools
    at: Ints
    aim: Ints
    left: Floats
    growth: Floats
    weight: Floats
    deadline: Floats
    appears: Floats
    is_open: Bools
    begun: Bools
    allowed: Bools
    start_distance: Floats
    distance: Floats
    home: Floats
    place: Floats
    site: Floats
    metric: int
    pace: float
    event_hour: Floats
    event_amount: Floats
    event_kind: Ints
    event_index: Ints
    has_missed: bool
    price: float
    scale: float
