"""Exploration by agents that know of no task to do."""

import math

from alloc.allocators.online.contract import Briefing
from alloc.problems.missions.chance import EXPLORING, uniform
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import STAY, AgentStatus, Order
from alloc.problems.vocabulary import Knowledge

TRIES = 8
"""Number of waypoints that are drawn before an agent stays where it is."""

BATTERY_SHARE = 0.25
"""Largest share of its battery that an agent spends on one exploration flight."""


class Explorer:
    """Random waypoints within the area of the mission, for agents that do not see all of it.

    Parameters
    ----------
    briefing : Briefing
    """

    def __init__(self, briefing: Briefing) -> None:
        self._seed, self._area, self._drawn = briefing.seed, briefing.area, 0
        self._is_blind = briefing.knowledge is Knowledge.LOCAL and briefing.sensing < math.inf

    def order(self, view: View) -> Order | None:
        """Return the exploration order of an agent without a task; None if it is already on its way."""
        own = view.own
        if not self._is_blind:
            return STAY
        if own.status is AgentStatus.FLYING and own.task is None:
            return None
        low, high = self._area
        for _ in range(TRIES):
            x, y, z = (a + (b - a) * self._draw() for a, b in zip(low, high, strict=True))
            place = Place((x, y, z))
            energy = own.facts.energy_per_distance * view.distance_to_place(own, place)
            is_cheap = own.battery == math.inf or energy <= BATTERY_SHARE * own.battery
            if is_cheap and view.refusal_of_place(own, place) is None:
                return Order(position=(x, y, z))
        return STAY

    def _draw(self) -> float:
        self._drawn += 1
        return uniform(EXPLORING, *self._seed, self._drawn)
