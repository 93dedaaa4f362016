"""Knowledge of agents and tasks: reports, each with the hour at which it was true, messages and views."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems.fields import FloatArray
from alloc.problems.missions.simulation.motion import battery_at, place_at, refusal, work_left
from alloc.problems.missions.simulation.places import Distances, Place
from alloc.problems.missions.simulation.state import (
    AgentFacts,
    AgentState,
    AgentStatus,
    MissionState,
    TaskFacts,
    TaskState,
    TaskStatus,
)

BYTES_OF_MESSAGE, BYTES_OF_AGENT, BYTES_OF_TASK, BYTES_OF_VALUE = 16, 40, 48, 8
"""Size of a message, packed in 4-byte numbers: header with sender and hour; place, battery, order and hour of an agent;
place, work left, priority, deadline and hour of a task; and each value added by a policy."""


@dataclass(frozen=True, slots=True)
class AgentReport:
    """An agent as it was at an hour.

    Attributes
    ----------
    facts : AgentFacts
    hour : float
    status : AgentStatus
    place : Place
    battery : float
    task : str or None
        Id of the task to which it was flying or at which it was working.
    """

    facts: AgentFacts
    hour: float
    status: AgentStatus
    place: Place
    battery: float
    task: str | None


@dataclass(frozen=True, slots=True)
class TaskReport:
    """A task as it was at an hour."""

    facts: TaskFacts
    hour: float
    status: TaskStatus
    left: float


@dataclass(frozen=True, slots=True)
class Message:
    """A message of an agent: its knowledge of agents and tasks, and notes of its policy.

    Attributes
    ----------
    sender : str
    hour : float
    agents : tuple of AgentReport
    tasks : tuple of TaskReport
    notes : tuple of str and float
        Values added by the policy, such as bids, of 8 bytes each.
    """

    sender: str
    hour: float
    agents: tuple[AgentReport, ...] = ()
    tasks: tuple[TaskReport, ...] = ()
    notes: tuple[str | float, ...] = ()

    @property
    def size(self) -> int:
        """Size in bytes."""
        reports = BYTES_OF_AGENT * len(self.agents) + BYTES_OF_TASK * len(self.tasks)
        return BYTES_OF_MESSAGE + reports + BYTES_OF_VALUE * len(self.notes)


class View:
    """Knowledge of an agent, or of a central policy, at a decision.

    Attributes
    ----------
    hour : float
    id : str or None
        Id of the agent whose view it is; None for a central policy.
    agents : mapping of str to AgentReport
        By id, the agent itself included.
    tasks : mapping of str to TaskReport
    heard : tuple of Message
        Messages received since the last decision, oldest first.
    """

    def __init__(
        self,
        hour: float,
        name: str | None,
        agents: Mapping[str, AgentReport],
        tasks: Mapping[str, TaskReport],
        distances: Distances,
        heard: tuple[Message, ...] = (),
    ) -> None:
        self.hour, self.id, self.agents, self.tasks, self.heard = hour, name, agents, tasks, heard
        self._distances = distances

    @property
    def metric(self) -> str:
        """Metric of distances; see `Instance`."""
        return self._distances.metric

    @property
    def distance_unit(self) -> str:
        """Unit of geographic distances."""
        return self._distances.unit

    @property
    def has_table(self) -> bool:
        """Whether distances are given by a table."""
        return self._distances.has_table

    @property
    def own(self) -> AgentReport:
        """The present report of the agent whose view this is."""
        if self.id is None:
            raise TypeError("the view of a central policy has no own agent")
        return self.agents[self.id]

    def distance(self, agent: AgentReport, task: TaskReport) -> float:
        """Return the distance from an agent to a task by their reports."""
        return self._distances.between(agent.place, task.facts.place)

    def hours(self, agent: AgentReport, task: TaskReport) -> float:
        """Return the hours of an agent's flight to a task."""
        return self.distance(agent, task) / agent.facts.speed

    def distances(self, places: Sequence[Place], tasks: Sequence[TaskReport]) -> FloatArray:
        """Return the distances from places to tasks, shape (places, tasks)."""
        goals = [task.facts.place for task in tasks]
        if self._distances.has_table:
            return np.array([[self._distances.between(place, goal) for goal in goals] for place in places])
        return self._distances.table([place.position for place in places], [goal.position for goal in goals])

    def distance_to_place(self, agent: AgentReport, place: Place) -> float:
        """Return the distance from an agent's reported place to another place."""
        return self._distances.between(agent.place, place)

    def between(self, one: TaskReport, other: TaskReport) -> float:
        """Return the distance from one task to another."""
        return self._distances.between(one.facts.place, other.facts.place)

    def refusal(self, agent: AgentReport, task: TaskReport) -> str | None:
        """Return why an agent cannot take a task, by their reports; None if it can."""
        if task.status is not TaskStatus.OPEN:
            return f"the task is {task.status}"
        if agent.task == task.facts.id:
            return None
        return refusal(self._distances, agent.facts, agent.place, agent.battery, task.facts.place, task.facts)

    def refusal_of_place(self, agent: AgentReport, place: Place) -> str | None:
        """Return why an agent cannot fly to a place; None if it can."""
        return refusal(self._distances, agent.facts, agent.place, agent.battery, place, None)

    def open_tasks(self, agent: AgentReport) -> list[TaskReport]:
        """Return the tasks that an agent can take, as known, in the order in which they became known."""
        return [task for task in self.tasks.values() if self.refusal(agent, task) is None]

    def of(self, agents: Mapping[str, AgentReport], tasks: Mapping[str, TaskReport]) -> "View":
        """Return a central view restricted to the given reports of agents and tasks."""
        return View(self.hour, None, agents, tasks, self._distances)

    def message(self, notes: tuple[str | float, ...] = ()) -> Message:
        """Return a message with all reports of this view and with `notes`."""
        assert self.id is not None
        return Message(self.id, self.hour, tuple(self.agents.values()), tuple(self.tasks.values()), notes)


def report_agent(state: MissionState, agent: AgentState) -> AgentReport:
    """Return the present report of an agent."""
    place, battery = place_at(state, agent), battery_at(state, agent)
    if state.distances.has_table and agent.flight is not None:  # it cannot be diverted before
        place = agent.flight.goal
        battery = agent.battery - agent.facts.energy_per_distance * agent.flight.distance
    return AgentReport(agent.facts, state.hour, agent.status, place, battery, agent.order.task)


def report_task(state: MissionState, task: TaskState) -> TaskReport:
    """Return the present report of a task."""
    return TaskReport(task.facts, state.hour, task.status, work_left(state, task))
