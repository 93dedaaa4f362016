"""Who is in contact with an agent, directly or by others that pass messages on."""

import numpy as np

from alloc.allocators.online.routes.tables import by_metric, is_fixed, positions
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import ACTIVE


def in_contact(view: View, radius: float, since: float) -> list[str]:
    """Return the agents that messages of an agent reach in one or more steps, the agent itself included.

    Agents that see farther than their radio reaches know of others that do not hear them. Those within the radius of
    each other can have flown apart since they were reported. Where distances do not come of positions in a plane, all
    count that are known well enough.

    Parameters
    ----------
    view : View
    radius : float
        Of the radio.
    since : float
        Hour; reports from before do not count.

    Returns
    -------
    list of str
        In the order of their ids.
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
