"""Routes that were planned for agents, as messages tell of them."""

from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import islice


@dataclass(frozen=True, slots=True)
class Route:
    """What was planned for one agent.

    Attributes
    ----------
    hour : float
        When it was planned.
    planner : str
        By whom.
    visits : tuple of (str, float)
        Tasks in their order, and the hour at which each was to be done.
    """

    hour: float
    planner: str
    visits: tuple[tuple[str, float], ...]

    @property
    def tasks(self) -> list[str]:
        """Ids of its tasks, in their order."""
        return [name for name, _ in self.visits]


class Announced:
    """The newest route of each agent that an agent has planned or heard of.

    Attributes
    ----------
    routes : dict of str to Route
        By agent.
    """

    def __init__(self) -> None:
        self.routes: dict[str, Route] = {}

    def plan(self, agent: str, route: Route) -> None:
        """Take notice of a route, unless a newer one is known; of two of one hour that of the first planner counts."""
        known = self.routes.get(agent)
        if known is None or (-route.hour, route.planner) < (-known.hour, known.planner):
            self.routes[agent] = route

    def notes(self) -> tuple[str | float, ...]:
        """Return all routes as notes of a message."""
        values: list[str | float] = []
        for agent, route in self.routes.items():
            values += [agent, route.hour, route.planner, float(len(route.visits))]
            values += [value for visit in route.visits for value in visit]
        return tuple(values)

    def hear(self, notes: Sequence[str | float]) -> None:
        """Take over what is newer in the notes of a message."""
        values = iter(notes)
        for agent in values:
            hour, planner, count = islice(values, 3)
            parts = list(islice(values, 2 * int(count)))
            visits = tuple((str(name), float(until)) for name, until in zip(parts[::2], parts[1::2], strict=True))
            self.plan(str(agent), Route(float(hour), str(planner), visits))

    def taken(self, group: Set[str], hour: float, patience: float) -> set[str]:
        """Return the tasks of agents outside a group: until the planned end, and `patience` times as long after it."""
        return {
            name
            for agent, route in self.routes.items()
            if agent not in group
            for name, until in route.visits
            if hour <= until + patience * (until - route.hour)
        }
