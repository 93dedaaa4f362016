"""Agents that are in contact with an agent, directly or through others that relay messages."""

import numpy as np

from alloc.allocators.online.routes.tables import by_metric, is_fixed, positions
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import ACTIVE


def in_contact(view: View, radius: float, since: float) -> list[str]:
    """Return the agents that an agent's messages reach in one or more hops, the agent itself included.

    An agent that senses farther than its radio reaches knows of agents that cannot hear it. Two agents count as
    connected if they may be within the radius, given how far each can have flown since it was reported. Where distances
    do not follow from positions in a plane, all recently reported agents count.

    Parameters
    ----------
    view : View
    radius : float
        Radio radius.
    since : float
        Hour; older reports do not count.

    Returns
    -------
    list of str
        Sorted ids.
    """
    names = sorted(
        name for name, one in view.agents.items() if name == view.id or (one.status in ACTIVE and one.hour >= since)
    )
    if radius == np.inf or is_fixed(view):
        return names
    reports = [view.agents[name] for name in names]
    places = positions([one.place for one in reports])
    flown = np.array([one.facts.speed * (view.hour - one.hour) if one.hour < view.hour else 0.0 for one in reports])
    near = by_metric(view.metric, places, places) <= radius + TOLERANCE + flown[:, None] + flown
    reached = np.array([name == view.id for name in names])
    while (more := reached | near[reached].any(axis=0)).sum() > reached.sum():
        reached = more
    return [name for name, is_reached in zip(names, reached.tolist(), strict=True) if is_reached]
