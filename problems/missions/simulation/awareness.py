"""Who knows what: all that is so now, or what each agent sensed and heard."""

import math
from types import MappingProxyType
from typing import Protocol

from alloc.problems.missions.simulation.motion import place_at
from alloc.problems.missions.simulation.reports import AgentReport, Message, TaskReport, View, report_agent, report_task
from alloc.problems.missions.simulation.state import ACTIVE, AgentState, AgentStatus, MissionState, TaskStatus

Agents = dict[str, AgentReport]
Tasks = dict[str, TaskReport]


class Awareness(Protocol):
    """What agents know; a simulation keeps it up to date."""

    def look_around(self, agent: AgentState) -> None:
        """Let an agent sense what is near."""

    def hear(self, agent: AgentState, message: Message) -> None:
        """Let an agent hear a message."""

    def refresh(self) -> None:
        """Take notice of what has happened, before anybody decides."""

    def view(self, agent: AgentState | None) -> View:
        """Return what an agent knows now, or who leads all of them."""

    def knows(self, agent: AgentState, task: str) -> bool:
        """Whether an agent knows of a task."""


class FullAwareness:
    """Everybody knows all that is so now, and nothing of the future; orders too, as soon as they are given."""

    def __init__(self, state: MissionState) -> None:
        self._state = state
        self._agents: Agents = {}
        self._tasks: Tasks = {}

    def look_around(self, agent: AgentState) -> None:
        """Take notice of the agent's new order: it knows all else already."""
        self._agents[agent.facts.id] = report_agent(self._state, agent)

    def hear(self, agent: AgentState, message: Message) -> None:
        """Do nothing: there is nothing that it does not know."""

    def refresh(self) -> None:
        """Report everybody and everything anew."""
        for agent in self._state.agents:
            if agent.status is not AgentStatus.ABSENT:
                self._agents[agent.facts.id] = report_agent(self._state, agent)
        for task in self._state.tasks:
            if task.status is not TaskStatus.TO_COME:
                self._tasks[task.facts.id] = report_task(self._state, task)

    def view(self, agent: AgentState | None) -> View:
        """Return the same for all."""
        name = None if agent is None else agent.facts.id
        agents, tasks = MappingProxyType(self._agents), MappingProxyType(self._tasks)
        return View(self._state.hour, name, agents, tasks, self._state.distances)

    def knows(self, agent: AgentState, task: str) -> bool:
        """Whether the task has appeared."""
        return task in self._tasks


class LocalAwareness:
    """Each agent knows itself, what it sensed and what it was told; newer reports replace older ones."""

    def __init__(self, state: MissionState) -> None:
        self._state, self._radius = state, state.mission.sensing
        self._agents: list[Agents] = [{} for _ in state.agents]
        self._tasks: list[Tasks] = [{} for _ in state.agents]
        self._heard: list[list[Message]] = [[] for _ in state.agents]

    def look_around(self, agent: AgentState) -> None:
        """Let an agent see all tasks and all agents in the mission within its sensing radius, itself first."""
        state = self._state
        agents, tasks = self._agents[agent.index], self._tasks[agent.index]
        agents[agent.facts.id] = report_agent(state, agent)
        here = place_at(state, agent).position
        for other in state.agents:
            if other is not agent and other.status in ACTIVE and self._sees(here, place_at(state, other).position):
                agents[other.facts.id] = report_agent(state, other)
        for task in state.tasks:
            if task.status is not TaskStatus.TO_COME and self._sees(here, task.facts.place.position):
                tasks[task.facts.id] = report_task(state, task)

    def _sees(self, here: tuple[float, float, float] | None, there: tuple[float, float, float] | None) -> bool:
        return self._radius == math.inf or self._state.distances.by_metric(here, there) <= self._radius

    def hear(self, agent: AgentState, message: Message) -> None:
        """Let an agent take over what is newer in a message than what it knows."""
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
        """Do nothing: each agent has looked around by itself."""

    def view(self, agent: AgentState | None) -> View:
        """Return what an agent knows now; it keeps none of what it heard beyond this decision."""
        assert agent is not None
        index = agent.index
        self._agents[index][agent.facts.id] = report_agent(self._state, agent)
        heard, self._heard[index] = tuple(self._heard[index]), []
        agents, tasks = MappingProxyType(self._agents[index]), MappingProxyType(self._tasks[index])
        return View(self._state.hour, agent.facts.id, agents, tasks, self._state.distances, heard)

    def knows(self, agent: AgentState, task: str) -> bool:
        """Whether an agent has a report of the task."""
        return task in self._tasks[agent.index]
