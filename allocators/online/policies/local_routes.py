"""The policy `local-routes`: among agents in contact, one plans the routes of all."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from alloc.allocators.contract.parameters import bounded
from alloc.allocators.online.contract import AgentDecider, Briefing, Policy, PolicyInfo
from alloc.allocators.online.groups.announced import Announced, Route
from alloc.allocators.online.groups.contact import in_contact
from alloc.allocators.online.policies.routes import RouteSearch, RoutesParameters
from alloc.allocators.online.policies.spreading import Lookout
from alloc.allocators.online.routes.describe import Foresight
from alloc.allocators.online.routes.plan import finish_hours, warm_up
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.reports import AgentReport, Message, View
from alloc.problems.missions.simulation.state import AgentStatus, Order, TaskStatus
from alloc.problems.vocabulary import Knowledge


@dataclass(frozen=True)
class LocalRoutesParameters(RoutesParameters):
    """Parameters of routes that agents plan for each other.

    Attributes
    ----------
    contact : float
        Radio periods after which agents that were not heard of are no longer planned for.
    patience : float
        Delay after the planned end of another agent's route, relative to the planned duration, after which its tasks
        are planned anew.
    fresh : float
        Radio periods after which idle agents explore a place again.
    """

    iterations: int = bounded(300, low=0)
    first_iterations: int = bounded(1000, low=0)
    contact: float = bounded(6.0, low=0)
    patience: float = bounded(3.0, low=0)
    fresh: float = bounded(50.0, low=0)


class LocalRoutes(Policy):
    """Among agents in contact, the one with the smallest id plans routes for all and announces them in messages.

    Raises
    ------
    InputError
        If a parameter is out of range.
    """

    info = PolicyInfo(name="local-routes", summary="sequences of tasks, planned by one agent for all in contact")
    parameters_type: ClassVar[type] = LocalRoutesParameters

    def __init__(self, parameters: LocalRoutesParameters | None = None, **settings: object) -> None:
        super().__init__(parameters, **settings)
        warm_up()

    def begin(self, briefing: Briefing) -> AgentDecider:
        """Return the decider of an agent: it plans routes or follows them."""
        return _Planner(self.parameters, briefing)


class _Planner(AgentDecider):
    def __init__(self, parameters: LocalRoutesParameters, briefing: Briefing) -> None:
        period = briefing.radio.period
        self._parameters, self._search = parameters, RouteSearch(parameters, briefing)
        self._contact = parameters.contact * period + briefing.radio.delay
        self._radius = briefing.radio.radius
        self._lookout = Lookout(briefing, parameters.fresh * period)
        self._is_alone = briefing.knowledge is Knowledge.FULL
        self._announced = Announced()
        self._planned: tuple[object, ...] = ()
        self._waits_since = math.inf

    def decide(self, view: View) -> Order | None:
        """Return the first task of the agent's route, after planning anew if agents or tasks have changed."""
        for message in view.heard:
            self._announced.hear(message.notes)
        open_tasks = {name for name, task in view.tasks.items() if task.status is TaskStatus.OPEN}
        self._announced.forget(view.agents.keys(), open_tasks, view.hour, self._parameters.patience)
        self._lookout.note(view)
        group = in_contact(view, self._radius, view.hour - self._contact)
        is_planner = self._is_alone or group[0] == view.id
        if is_planner or self._has_waited(view, group):
            self._renew(view, group if is_planner else [str(view.id)])
        if not self._tasks_open(view, str(view.id)):
            self._help(view, group)
        for name in self._tasks_of(str(view.id)):
            task = view.tasks.get(name)
            if task is not None and view.refusal(view.own, task) is None:
                return Order(name)
        if self._tasks_open(view, str(view.id)):  # its battery no longer suffices: leave them to others
            self._announced.plan(str(view.id), Route(view.hour, str(view.id), ()))
        return self._lookout.order(view, [self._end(view, name) for name in group if name != view.id])

    def _help(self, view: View, group: list[str]) -> None:
        """Let an agent without tasks take the nearest task of agents out of contact that are late or would be later."""
        taken = self._announced.taken(set(group), view.hour, self._parameters.patience)
        best, least = None, math.inf
        for task in view.open_tasks(view.own):
            until, hours = taken.get(task.facts.id, math.nan), view.hours(view.own, task)
            if hours < least and (until < view.hour or until > view.hour + hours + self._contact):
                best, least = task, hours
        if best is not None:
            until = view.hour + view.hours(view.own, best) + best.left / view.own.facts.ability
            self._announced.plan(str(view.id), Route(view.hour, str(view.id), ((best.facts.id, until),)))

    def message(self, view: View) -> Message | None:
        """Return a message with all that the agent knows, and all routes."""
        return view.message(self._announced.notes())

    def _has_waited(self, view: View, group: list[str]) -> bool:
        """Whether unplanned tasks were open, and the agent had none, for longer than a plan takes to arrive."""
        if self._tasks_open(view, str(view.id)) or not (self._open(view, set(group)) - self._planned_for(group)):
            self._waits_since = math.inf
        self._waits_since = min(self._waits_since, view.hour)
        return view.hour - self._waits_since > self._contact

    def _tasks_of(self, name: str) -> list[str]:
        route = self._announced.routes.get(name)
        return [] if route is None else route.tasks

    def _tasks_open(self, view: View, name: str) -> list[str]:
        tasks = ((task, view.tasks.get(task)) for task in self._tasks_of(name))
        return [task for task, report in tasks if report is not None and report.status is TaskStatus.OPEN]

    def _planned_for(self, group: list[str]) -> set[str]:
        return {task for name in group for task in self._tasks_of(name)}

    def _open(self, view: View, group: set[str]) -> set[str]:
        """Return the open tasks that are not reserved for agents outside the group."""
        taken = self._announced.taken(group, view.hour, self._parameters.patience)
        return {name for name, task in view.tasks.items() if task.status is TaskStatus.OPEN and name not in taken}

    def _end(self, view: View, name: str) -> Place:
        """Return the place where an agent's route ends."""
        tasks = self._tasks_open(view, name)
        return view.tasks[tasks[-1]].facts.place if tasks else view.agents[name].place

    def _renew(self, view: View, group: list[str]) -> None:
        """Plan routes for a group, if its agents or tasks have changed since its last plan, or tasks are unplanned."""
        tasks = self._open(view, set(group))
        news = (*group, frozenset(tasks))
        if news == self._planned and tasks - self._planned_for(group) <= self._search.given_up:
            return
        self._planned = news
        agents = {name: _advanced(view, view.agents[name]) for name in group}
        known = {name: task for name, task in view.tasks.items() if name in tasks or task.status is not TaskStatus.OPEN}
        found = self._search.improve(view.of(agents, known), Foresight(), self._announced.joined(group))
        if found is None:
            return
        finish = finish_hours(found.described.situation, found.routes, found.lengths).tolist()
        names = [task.facts.id for task in found.described.tasks]
        until = {name: hour if hour < math.inf else view.hour for name, hour in zip(names, finish, strict=True)}
        for agent, route in found.names.items():
            visits = tuple((name, until[name]) for name in route)
            self._announced.plan(agent, Route(view.hour, str(view.id), visits))
        self._search.given_up = found.tried.difference(self._planned_for(group))


def _advanced(view: View, report: AgentReport) -> AgentReport:
    """Return a report of a flying agent extrapolated to now, assuming that it has kept its course."""
    goal = view.tasks.get(report.task or "")
    age = view.hour - report.hour
    here = report.place.position
    if report.status is not AgentStatus.FLYING or goal is None or age <= 0 or here is None or view.has_table:
        return report
    there, distance = goal.facts.place.position, view.distance(report, goal)
    if there is None or distance <= 0:
        return report
    share = min(1.0, age * report.facts.speed / distance)
    x, y, z = (a + share * (b - a) for a, b in zip(here, there, strict=True))
    battery = report.battery - report.facts.energy_per_distance * share * distance
    return replace(report, place=Place((x, y, z)), battery=max(0.0, battery))
