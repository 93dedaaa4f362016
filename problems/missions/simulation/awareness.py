"""Knowledge of agents: the full present state, or what each agent has sensed and heard."""

from types import MappingProxyType
from typing import Protocol

import numpy as np

from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import BoolArray
from alloc.problems.missions.simulation.motion import place_at
from alloc.problems.missions.simulation.places import Position
from alloc.problems.missions.simulation.reports import AgentReport, Message, TaskReport, View, report_agent, report_task
from alloc.problems.missions.simulation.state import ACTIVE, AgentState, AgentStatus, MissionState, TaskStatus

Agents = dict[str, AgentReport]
Tasks = dict[str, TaskReport]


class Awareness(Protocol):
    """Knowledge of agents, kept up to date by the simulation."""

    def look_around(self, agents: list[AgentState]) -> None:
        """Let agents sense their surroundings."""

    def hear(self, agent: AgentState, message: Message) -> None:
        """Let an agent receive a message."""

    def refresh(self) -> None:
        """Update knowledge before agents decide."""

    def view(self, agent: AgentState | None, *, is_glance: bool = False) -> View:
        """Return the present view of an agent; None stands for a central policy."""

    def objection(self, agent: AgentState, task: str) -> str | None:
        """Return why an agent refuses to go to a task by what it knows; None if it does not."""


class FullAwareness:
    """Full knowledge: all agents know the present state, orders included, but nothing of the future."""

    def __init__(self, state: MissionState) -> None:
        self._state = state
        self._agents: Agents = {}
        self._tasks: Tasks = {}

    def look_around(self, agents: list[AgentState]) -> None:
        """Update the agents' orders: everything else is already known."""
        for agent in agents:
            self._agents[agent.facts.id] = report_agent(self._state, agent)

    def hear(self, agent: AgentState, message: Message) -> None:
        """Do nothing, as the agent already knows everything."""

    def refresh(self) -> None:
        """Renew the reports of all agents and tasks."""
        for agent in self._state.agents:
            if agent.status is not AgentStatus.ABSENT:
                self._agents[agent.facts.id] = report_agent(self._state, agent)
        for task in self._state.tasks:
            if task.status is not TaskStatus.TO_COME:
                self._tasks[task.facts.id] = report_task(self._state, task)

    def view(self, agent: AgentState | None, *, is_glance: bool = False) -> View:
        """Return the present view, which is the same for all agents."""
        name = None if agent is None else agent.facts.id
        agents, tasks = MappingProxyType(self._agents), MappingProxyType(self._tasks)
        return View(self._state.hour, name, agents, tasks, self._state.distances)

    def objection(self, agent: AgentState, task: str) -> str | None:
        """Return why an agent refuses to go to a task: it is still to come, or closed."""
        return _objection(self._tasks.get(task))


class LocalAwareness:
    """Local knowledge: each agent knows itself and what it has sensed and heard; newer reports replace older ones."""

    def __init__(self, state: MissionState) -> None:
        self._state, self._radius = state, state.mission.sensing
        self._agents: list[Agents] = [{} for _ in state.agents]
        self._tasks: list[Tasks] = [{} for _ in state.agents]
        self._heard: list[list[Message]] = [[] for _ in state.agents]

    def look_around(self, agents: list[AgentState]) -> None:
        """Let agents report themselves, and all tasks and agents of the mission within their sensing radius."""
        if not agents:
            return
        state = self._state
        others = [agent for agent in state.agents if agent.status in ACTIVE]
        tasks = [task for task in state.tasks if task.status is not TaskStatus.TO_COME]
        sights = [report_agent(state, other) for other in others]
        finds = [report_task(state, task) for task in tasks]
        places = [place_at(state, agent).position for agent in agents]
        near = self._near(places, [place_at(state, other).position for other in others])
        near_tasks = self._near(places, [task.facts.place.position for task in tasks])
        for row, agent in enumerate(agents):
            seen, found = self._agents[agent.index], self._tasks[agent.index]
            seen[agent.facts.id] = report_agent(state, agent)
            for column in np.flatnonzero(near[row]).tolist():
                seen[others[column].facts.id] = sights[column]
            for column in np.flatnonzero(near_tasks[row]).tolist():
                found[tasks[column].facts.id] = finds[column]

    def _near(self, places: list[Position | None], goals: list[Position | None]) -> BoolArray:
        return self._state.distances.table(places, goals) <= self._radius + TOLERANCE

    def hear(self, agent: AgentState, message: Message) -> None:
        """Let an agent adopt those reports of a message that are newer than its own."""
        agents, tasks = self._agents[agent.index], self._tasks[agent.index]
        for report in message.agents:
            known = agents.get(report.facts.id)
            if known is None or known.hour < report.hour:
                agents[report.facts.id] = report
        for news in message.tasks:
            seen = tasks.get(news.facts.id)
            if seen is None or seen.hour < news.hour:
                tasks[news.facts.id] = news
        self._heard[agent.index].append(message)

    def refresh(self) -> None:
        """Do nothing, as agents sense by themselves."""

    def view(self, agent: AgentState | None, *, is_glance: bool = False) -> View:
        """Return the present view of an agent; messages are handed over only once, unless `is_glance`."""
        assert agent is not None
        index = agent.index
        self._agents[index][agent.facts.id] = report_agent(self._state, agent)
        heard = tuple(self._heard[index])
        if not is_glance:
            self._heard[index] = []
        agents, tasks = MappingProxyType(self._agents[index]), MappingProxyType(self._tasks[index])
        return View(self._state.hour, agent.facts.id, agents, tasks, self._state.distances, heard)

    def objection(self, agent: AgentState, task: str) -> str | None:
        """Return why an agent refuses to go to a task: it does not know the task, or knows that it is closed."""
        return _objection(self._tasks[agent.index].get(task))


def _objection(report: TaskReport | None) -> str | None:
    if report is None:
        return "the agent does not know the task"
    return None if report.status is TaskStatus.OPEN else f"the task is {report.status}"
