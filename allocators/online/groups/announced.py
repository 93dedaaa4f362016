"""Routes that were planned for agents, as announced in messages."""

import math
from collections.abc import Collection, Sequence, Set
from dataclasses import dataclass

SPARE_ROUTES = 200
"""Number of routes in addition to one per known agent; above twice the sum, those of unknown agents are dropped unless
an open task belongs to them."""


@dataclass(frozen=True, slots=True)
class Route:
    """The route that was planned for one agent.

    Attributes
    ----------
    hour : float
        Hour at which it was planned.
    planner : str
        Id of the agent that planned it.
    visits : tuple of (str, float)
        Tasks in order, with the hour at which each is to be done.
    """

    hour: float
    planner: str
    visits: tuple[tuple[str, float], ...]

    @property
    def end(self) -> float:
        """Hour at which the last task is to be done."""
        return max((until for _, until in self.visits), default=self.hour)

    @property
    def tasks(self) -> list[str]:
        """Ids of the tasks in order."""
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
        """Record a route unless a newer one is known; at equal hour and planner, it replaces the known one."""
        known = self.routes.get(agent)
        if known is None or (route.hour, known.planner) >= (known.hour, route.planner):
            self.routes[agent] = route

    def _is_news(self, agent: str, hour: float, planner: str) -> bool:
        """Whether a route is newer than the known one; at equal hours, the planner with the smaller id wins."""
        known = self.routes.get(agent)
        return known is None or (hour, known.planner) > (known.hour, planner)

    def notes(self) -> tuple[str | float, ...]:
        """Return all routes as notes of a message."""
        values: list[str | float] = []
        for agent, route in self.routes.items():
            values += [agent, route.hour, route.planner, float(len(route.visits))]
            values += [value for visit in route.visits for value in visit]
        return tuple(values)

    def hear(self, notes: Sequence[str | float]) -> None:
        """Adopt those routes in the notes of a message that are newer than the known ones."""
        begin = 0
        while begin < len(notes):
            agent, hour, planner, count = notes[begin : begin + 4]
            begin, end = begin + 4, begin + 4 + 2 * int(count)
            if self._is_news(str(agent), float(hour), str(planner)):
                names, hours = notes[begin:end:2], notes[begin + 1 : end : 2]
                visits = tuple((str(name), float(until)) for name, until in zip(names, hours, strict=True))
                self.routes[str(agent)] = Route(float(hour), str(planner), visits)
            begin = end

    def taken(self, group: Set[str], hour: float, patience: float) -> dict[str, float]:
        """Return the tasks that are reserved for agents outside a group, with the hour at which each is to be done.

        A task belongs to the newest route that contains it. A route is valid until its end plus `patience` times its
        planned duration.
        """
        owners = self._owners(group, hour, patience)
        return {name: until for name, (_, until, agent) in owners.items() if agent not in group}

    def forget(self, known: Collection[str], tasks: Collection[str], hour: float, patience: float) -> None:
        """Drop the routes of unknown agents to which no open task belongs, once there are far more than known agents.

        Parameters
        ----------
        known : collection of str
            Agents that are known.
        tasks : collection of str
            Open tasks.
        hour, patience : float
            As for `taken`.
        """
        if len(self.routes) <= 2 * (len(known) + SPARE_ROUTES):
            return
        owners = self._owners(frozenset(), hour, patience)
        needed = {agent for name, (_, _, agent) in owners.items() if name in tasks}
        self.routes = {name: route for name, route in self.routes.items() if name in known or name in needed}

    def _owners(self, group: Set[str], hour: float, patience: float) -> dict[str, tuple[float, float, str]]:
        """Return the newest route of each task: its hour, the hour at which the task is to be done, and the agent."""
        newest: dict[str, tuple[float, float, str]] = {}
        for agent, route in self.routes.items():
            if agent in group or hour <= route.end + patience * (route.end - route.hour):
                for name, until in route.visits:
                    newest[name] = max(newest.get(name, (-math.inf, 0.0, "")), (route.hour, until, agent))
        return newest

    def joined(self, group: Sequence[str]) -> dict[str, list[str]]:
        """Return the routes of a group; where several plans contain a task, the one that finishes it first keeps it."""
        routes = {agent: self.routes[agent] for agent in group if agent in self.routes}
        first: dict[str, tuple[float, float, str]] = {}
        for route in routes.values():
            for name, until in route.visits:
                first[name] = min(first.get(name, (math.inf, 0.0, "")), (until, route.hour, route.planner))
        return {
            agent: [name for name, _ in route.visits if first[name][1:] == (route.hour, route.planner)]
            for agent, route in routes.items()
        }
