"""Joint exploration: agents go where none has been for long, and otherwise spread out over the area."""

from collections.abc import Iterable

import numpy as np

from alloc.allocators.online.contract import Briefing
from alloc.allocators.online.policies.exploring import BATTERY_SHARE, Explorer
from alloc.allocators.online.routes.tables import by_metric, is_fixed, positions
from alloc.problems.fields import BoolArray, FloatArray
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import STAY, Order
from alloc.problems.vocabulary import Knowledge

CELLS = 20
"""Cells along the longer side of the area."""

NEAR = 0.1
"""Share of the sensing radius within which an agent counts as being at its goal."""


class Lookout:
    """Exploration orders for an agent that has nothing to do.

    The area is divided into cells, each of which belongs to the nearest agent. An agent goes to its cell with the
    largest ratio of hours since it was last seen to hours until the agent can see it; if all its cells were seen
    recently, to their centroid. A cell counts as seen if all of it is within the sensing radius, or its centre within
    half of the radius.

    Parameters
    ----------
    briefing : Briefing
    fresh : float
        Hours after which a cell is to be seen again.
    """

    def __init__(self, briefing: Briefing, fresh: float) -> None:
        self._explorer, self._sensing, self._fresh = Explorer(briefing), briefing.sensing, fresh
        self._is_blind = briefing.knowledge is Knowledge.LOCAL and briefing.sensing < np.inf
        low, high = np.array(briefing.area)
        side = max(float((high - low).max()) / CELLS, 1e-12)
        axes = [_middles(a, b, side) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
        self._cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        self._seen = np.full(len(self._cells), -np.inf)
        corner = sum(float(axis[0]) - least for axis, least in zip(axes, low.tolist(), strict=True))
        self._whole = max(self._sensing - corner, self._sensing / 2)
        self._goal = -1

    def note(self, view: View) -> None:
        """Mark the cells that agents have seen from their known places."""
        if not self._is_blind or is_fixed(view):
            return
        reports = [report for report in view.agents.values() if report.place.position is not None]
        near = self._distances(view, [report.place for report in reports]) <= self._whole
        hours = np.array([report.hour for report in reports])
        self._seen = np.maximum(self._seen, np.where(near, hours[:, None], -np.inf).max(axis=0, initial=-np.inf))

    def order(self, view: View, others: Iterable[Place]) -> Order | None:
        """Return an exploration order, given the places of other agents; None if the agent is already on its way."""
        own = view.own
        here = own.place.position
        if not self._is_blind or here is None or is_fixed(view):
            return self._explorer.order(view)
        ways = self._distances(view, [own.place, *(place for place in others if place.position is not None)])
        way, is_own = ways[0], ways[0] <= ways.min(axis=0)
        goal = self._place(view, way, is_own, own.facts.speed)
        distance = view.distance_to_place(own, Place(goal))
        energy = own.facts.energy_per_distance * distance
        is_cheap = own.battery == np.inf or energy <= BATTERY_SHARE * own.battery
        if distance <= NEAR * self._sensing or not is_cheap or view.refusal_of_place(own, Place(goal)) is not None:
            return STAY
        return Order(position=goal)

    def _place(self, view: View, way: FloatArray, is_own: BoolArray, speed: float) -> tuple[float, float, float]:
        age = view.hour - np.maximum(self._seen, -1e9)
        old = is_own & (age > self._fresh)
        if old.any():
            if self._goal < 0 or not old[self._goal]:
                hours = np.maximum(way - self._sensing / 2, NEAR * self._sensing) / speed
                self._goal = int(np.argmax(np.where(old, age / hours, -np.inf)))
            x, y, z = self._cells[self._goal].tolist()
            return x, y, z
        self._goal = -1
        x, y, z = self._cells[is_own].mean(axis=0).tolist() if is_own.any() else self._cells[np.argmin(way)].tolist()
        return x, y, z

    def _distances(self, view: View, places: list[Place]) -> FloatArray:
        """Return the distances of places to all cells, shape (places, cells)."""
        return by_metric(view.metric, positions(places), self._cells)


def _middles(low: float, high: float, side: float) -> FloatArray:
    """Return the centres of cells along an axis."""
    count = max(1, round((high - low) / side))
    return low + (high - low) * (np.arange(count) + 0.5) / count
