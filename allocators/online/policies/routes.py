"""The policy `routes`: plans sequences of tasks, and improves the plan at every event."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from alloc.allocators.contract.parameters import CheckedParameters, bounded
from alloc.allocators.online.contract import Briefing, FleetDecider, Policy, PolicyInfo
from alloc.allocators.online.routes.describe import Described, Describer, Foresight
from alloc.allocators.online.routes.plan import first_tasks, improved, warm_up
from alloc.allocators.online.routes.situation import Ints
from alloc.problems.missions.simulation.reports import View
from alloc.problems.missions.simulation.state import ACTIVE, STAY, Order, TaskStatus

DEADLINE_SHARE = 0.6
"""Share of the decision's time limit that the search gets; the rest is for the view and the orders."""


@dataclass(frozen=True)
class RoutesParameters(CheckedParameters):
    """Parameters of route planning.

    Attributes
    ----------
    iterations : int
        Changes of the plan that are tried at each event, unless the deadline ends the search.
    first_iterations : int
        The same for the first plan.
    switch_price : float
        Penalty for each agent that leaves its task for another, in units of the hours that all work would take if
        flights took no time, >= 0.
    """

    iterations: int = bounded(1000, low=0)
    first_iterations: int = bounded(3000, low=0)
    switch_price: float = bounded(0.2, low=0)


class Routes(Policy):
    """Each agent has a sequence of tasks, coalitions meet at tasks, and local search improves the plan at every event.

    Raises
    ------
    InputError
        If a parameter is out of range.

    References
    ----------
    Christiaens and Vanden Berghe (2020), doi:10.1287/trsc.2019.0914: removal of adjacent visits, insertion with blinks.
    """

    info = PolicyInfo(name="routes", summary="sequences of tasks, improved at every event", central=True)
    parameters_type: ClassVar[type] = RoutesParameters

    def __init__(self, parameters: RoutesParameters | None = None, **settings: object) -> None:
        super().__init__(parameters, **settings)
        warm_up()

    def begin(self, briefing: Briefing) -> FleetDecider:
        """Return the planner of all routes."""
        return RoutePlanner(self.parameters, briefing)


class ImprovedRoutes(NamedTuple):
    """Result of a search: routes of all agents of a situation.

    Attributes
    ----------
    described : Described
    routes, lengths : ndarray of int, shapes (n, c) and (n,)
        Task indices of each agent, and the length of each route.
    names : dict of str to list of str
        Task ids of each agent, by agent id.
    tried : set of str
        Tasks whose insertion was tried in time.
    """

    described: Described
    routes: Ints
    lengths: Ints
    names: dict[str, list[str]]
    tried: set[str]


class RouteSearch:
    """Improves routes whenever the situation has changed.

    Parameters
    ----------
    parameters : RoutesParameters
    briefing : Briefing

    Attributes
    ----------
    describer : Describer
    given_up : set of str
        Tasks in no route although their insertion was tried.
    """

    def __init__(self, parameters: RoutesParameters, briefing: Briefing) -> None:
        pace = 1.0 if briefing.pace is None else (briefing.pace.low + briefing.pace.high) / 2
        self._parameters, self._seed, self._count = parameters, briefing.seed[0], 0
        self.describer = Describer(briefing.end, max(pace, 1e-9), parameters.switch_price)
        limit = briefing.deadline_s
        self._time_limit_s = None if limit is None else DEADLINE_SHARE * limit
        self.given_up: set[str] = set()

    def improve(self, view: View, foresight: Foresight, before: Mapping[str, list[str]]) -> ImprovedRoutes | None:
        """Return routes improved from those before; None if there is nothing to plan."""
        began = time.perf_counter()
        described = self.describer.describe(view, foresight)
        if described is None:
            return None
        iterations = self._parameters.iterations if self._count else self._parameters.first_iterations
        self._count += 1
        until = None if self._time_limit_s is None else began + self._time_limit_s
        seed = (self._seed * 1_000_003 + self._count) % 2**31
        routes, lengths, untried = improved(described, before, iterations, seed, until, self.given_up)
        ids = [task.facts.id for task in described.tasks]
        names = {
            agent.facts.id: [ids[j] for j in routes[i, : lengths[i]].tolist()]
            for i, agent in enumerate(described.agents)
        }
        tried = {name for name, is_untried in zip(ids, untried.tolist(), strict=True) if not is_untried}
        return ImprovedRoutes(described, routes, lengths, names, tried)


class RoutePlanner(FleetDecider):
    """Decides for all agents by planning routes.

    Parameters
    ----------
    parameters : RoutesParameters
    briefing : Briefing
    """

    def __init__(self, parameters: RoutesParameters, briefing: Briefing) -> None:
        self._search = RouteSearch(parameters, briefing)
        self._routes: dict[str, list[str]] = {}

    def foresight(self, view: View) -> Foresight:
        """Return what is known of the future: nothing."""
        return Foresight()

    def decide(self, view: View) -> Mapping[str, Order]:
        """Improve the routes, and return the first task of each as an order."""
        found = self._search.improve(view, self.foresight(view), self._routes)
        if found is None:
            return {}
        self._routes = found.names
        self._search.given_up = found.tried.difference(*self._routes.values())
        first = first_tasks(found.described.situation, found.routes, found.lengths)
        return dict(self._orders(view, found.described, first))

    def _orders(self, view: View, described: Described, first: Ints) -> list[tuple[str, Order]]:
        orders = []
        for agent, j in zip(described.agents, first.tolist(), strict=True):
            if agent.status not in ACTIVE:
                continue
            order = STAY
            if j >= 0:
                task = described.tasks[j]
                order = Order(task.facts.id)
                if task.status is TaskStatus.TO_COME:
                    site = task.facts.place
                    is_there = view.distance_to_place(agent, site) == 0
                    order = (
                        STAY if site.position is None or view.has_table or is_there else Order(position=site.position)
                    )
            orders.append((agent.facts.id, order))
        return orders
