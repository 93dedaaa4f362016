"""Conversion of a view of a mission into the arrays of a situation."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from alloc.allocators.online.routes.situation import (
    AGENT,
    EUCLIDEAN,
    EVENT,
    FIXED,
    IN,
    MANHATTAN,
    OPENS,
    TASK,
    Bools,
    Floats,
    Ints,
    Records,
    Situation,
    records,
)
from alloc.allocators.online.routes.tables import TaskTables, by_metric, is_fixed, positions
from alloc.problems.missions.simulation.reports import AgentReport, TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, AgentStatus, TaskStatus
from alloc.problems.vocabulary import MANHATTAN as MANHATTAN_METRIC

PRIORITY_OF_NONE = 1e-3
"""Priority assigned to tasks with priority 0, relative to the largest, as they have to be done as well."""

SPARE_TASKS = 1000
"""Number of entries in addition to one per open task; above twice the sum, those of closed tasks are dropped."""


@dataclass(frozen=True)
class Foresight:
    """What is known of the future.

    Attributes
    ----------
    tasks : mapping of str to TaskReport
        Tasks that will appear, with status ``to come``.
    agents : mapping of str to AgentReport
        Agents that will join.
    events : sequence of (hour, kind, id, amount)
        Sorted by hour.
    """

    tasks: Mapping[str, TaskReport] = field(default_factory=dict)
    agents: Mapping[str, AgentReport] = field(default_factory=dict)
    events: Sequence[tuple[float, int, str, float]] = ()


@dataclass(frozen=True)
class Described:
    """A situation, with the agents and tasks of its rows, and the nearest tasks of each task."""

    situation: Situation
    agents: list[AgentReport]
    tasks: list[TaskReport]
    nearest: Ints


class Describer:
    """Describes the situations of one mission; remembers distances and which growing tasks were begun.

    Parameters
    ----------
    end : float
        Hour at which the mission ends.
    pace : float
        Work of a group per hour over its ability, on average.
    price : float
        Penalty of a switch, in units of the hours that all work would take without flights.
    """

    def __init__(self, end: float, pace: float, price: float) -> None:
        self._end, self._pace, self._price = end, pace, price
        self._begun: set[str] = set()
        self._seen: dict[str, tuple[float, float]] = {}
        self._tables = TaskTables()

    def describe(self, view: View, foresight: Foresight) -> Described | None:
        """Return the situation of a view; None if there are no agents, now or later, or no tasks."""
        coming = {name for _, kind, name, _ in foresight.events if kind == IN}
        known = {**view.agents, **foresight.agents}
        agents = [one for name, one in known.items() if one.status in ACTIVE or name in coming]
        tasks = [one for one in view.tasks.values() if one.status is TaskStatus.OPEN]
        self._note_begun(view.hour, agents, tasks)
        tasks += [one for name, one in foresight.tasks.items() if name not in view.tasks]
        if not agents or not tasks:
            return None
        self._tables.look_up(view, tasks)
        distance, nearest = self._tables.distances()
        return Described(self._situation(view, agents, tasks, foresight, distance), agents, tasks, nearest)

    def _note_begun(self, hour: float, agents: list[AgentReport], tasks: list[TaskReport]) -> None:
        """Note the growing tasks that were begun: those where an agent works, or that no longer grow."""
        self._begun.update(str(one.task) for one in agents if one.status is AgentStatus.WORKING)
        for task in tasks:
            if task.facts.growth > 0:
                name = task.facts.id
                before, left = self._seen.get(name, (hour, 0.0))
                if before < hour and task.left <= left:
                    self._begun.add(name)
                self._seen[name] = hour, task.left
        if len(self._begun) + len(self._seen) > 2 * (len(tasks) + SPARE_TASKS):
            names = {task.facts.id for task in tasks}
            self._begun &= names
            self._seen = {name: seen for name, seen in self._seen.items() if name in names}

    def _situation(
        self,
        view: View,
        agents: list[AgentReport],
        tasks: list[TaskReport],
        foresight: Foresight,
        distance: Floats,
    ) -> Situation:
        row = {one.facts.id: i for i, one in enumerate(agents)}
        column = {one.facts.id: j for j, one in enumerate(tasks)}
        place, site = positions([one.place for one in agents]), self._tables.site[self._tables.rows]
        ability, left = _array([one.facts.ability for one in agents]), _array([one.left for one in tasks])
        aim = np.array([column.get(one.task or "", -1) for one in agents])
        works = np.array([one.status is AgentStatus.WORKING for one in agents])
        rows = records(
            AGENT,
            len(agents),
            ability=ability,
            speed=[one.facts.speed for one in agents],
            consumption=[one.facts.energy_per_distance for one in agents],
            reach=[one.facts.range for one in agents],
            battery=[one.battery for one in agents],
            free=view.hour,
            active=[one.status in ACTIVE for one in agents],
            at=np.where(works, aim, -1),
            aim=aim,
        )
        events = [
            (hour, amount, kind, (row if kind < OPENS else column)[name])
            for hour, kind, name, amount in foresight.events
            if name in row or name in column
        ]
        fixed = is_fixed(view)
        return Situation(
            hour=float(view.hour),
            end=float(self._end),
            agents=rows,
            tasks=self._task_rows(tasks, left),
            events=np.array(events, EVENT),
            allowed=_allowed(agents, tasks),
            start_distance=_starts(view, agents, tasks) if fixed else by_metric(view.metric, place, site),
            distance=distance,
            home=_home(view, agents, tasks),
            place=place,
            site=site,
            metric=FIXED if fixed else MANHATTAN if view.metric == MANHATTAN_METRIC else EUCLIDEAN,
            pace=float(self._pace),
            has_missed=any(one.status is TaskStatus.MISSED for one in view.tasks.values()),
            price=float(self._price),
            scale=max(1e-9, float(left.sum() / (ability.sum() * self._pace))),
        )

    def _task_rows(self, tasks: list[TaskReport], left: Floats) -> Records:
        known, now = self._tables, self._tables.rows
        return records(
            TASK,
            len(tasks),
            left=left,
            growth=known.growth[now],
            weight=_weights(known.priority[now]),
            deadline=known.deadline[now],
            appears=known.appears[now],
            is_open=[one.status is TaskStatus.OPEN for one in tasks],
            begun=[one.facts.id in self._begun for one in tasks],
        )


def _array(values: list[float]) -> Floats:
    return np.array(values, np.float64)


def _starts(view: View, agents: list[AgentReport], tasks: list[TaskReport]) -> Floats:
    return np.array([[view.distance(agent, task) for task in tasks] for agent in agents])


def _weights(priority: Floats) -> Floats:
    """Return priorities normalised to sum 1, small but positive for tasks with priority 0."""
    greatest = float(priority.max())
    weight = np.maximum(priority, PRIORITY_OF_NONE * greatest) if greatest > 0 else np.ones(len(priority))
    return np.asarray(weight / weight.sum(), np.float64)


def _allowed(agents: list[AgentReport], tasks: list[TaskReport]) -> Bools:
    allowed = np.ones((len(agents), len(tasks)), np.bool_)
    for i, agent in enumerate(agents):
        names = agent.facts.tasks
        if names is not None:
            allowed[i] = [task.facts.id in names for task in tasks]
    if any(task.facts.needs for task in tasks):
        allowed &= np.array([[task.facts.needs <= agent.facts.skills for task in tasks] for agent in agents])
    return allowed


def _home(view: View, agents: list[AgentReport], tasks: list[TaskReport]) -> Floats:
    home = np.zeros((len(tasks), len(agents)))
    for i, agent in enumerate(agents):
        if agent.facts.returns:
            for j, task in enumerate(tasks):
                there = AgentReport(agent.facts, view.hour, agent.status, agent.facts.start, 0.0, None)
                home[j, i] = view.distance(there, task)
    return home
