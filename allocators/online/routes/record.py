"""The arrays of a schedule: the state of its simulation, and its results."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.online.routes.queue import ENTRY
from alloc.allocators.online.routes.situation import Floats, Records

AGENT = np.dtype(
    [
        *(
            (name, np.int64)
            for name in ("first", "pointer", "target", "state", "node", "version", "following", "touched")
        ),
        *((name, np.float64) for name in ("fuel", "energy", "hours", "works", "departs", "arrives", "way")),
    ]
)
TASK = np.dtype(
    [
        *((name, np.int64) for name in ("closed", "is_open", "begun", "edition", "head", "touched", "visitors")),
        *((name, np.float64) for name in ("left", "since", "rate", "finish")),
    ]
)


class Schedule(NamedTuple):
    """State of the simulation of a plan, and its results.

    Attributes
    ----------
    agents, tasks : ndarray of `AGENT` and `TASK`, shape (n,) and (m,)
        Among others ``first``, the first task of each agent, -1 for none; ``finish``, the hour at which each task is
        done, ``inf`` if it is not; and ``touched``, whether the agent or task is to be scheduled anew.
    point : ndarray, shape (n, 3)
        Positions of agents that were diverted in flight.
    arrive, leave : ndarray, shape (n, c)
        Hours of each visit of the routes; NaN if the visit does not take place.
    totals : ndarray, shape (6,)
        Weight of tasks not done, hour of the last completion, weighted hours from appearance to completion, energy,
        hours of flight, hours at tasks.
    queue : ndarray of `ENTRY`
        Future completions, deadlines, events and arrivals.
    """

    agents: Records
    tasks: Records
    point: Floats
    arrive: Floats
    leave: Floats
    totals: Floats
    queue: Records


def new_schedule(n: int, m: int, capacity: int, events: int) -> Schedule:
    """Allocate a schedule for plans of a given size."""
    return Schedule(
        np.zeros(n, AGENT),
        np.zeros(m, TASK),
        np.empty((n, 3)),
        np.empty((n, capacity)),
        np.empty((n, capacity)),
        np.empty(6),
        np.zeros(2 * n * capacity + 3 * events + 2 * n + m + 16, ENTRY),
    )
