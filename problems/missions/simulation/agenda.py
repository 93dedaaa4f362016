"""The event queue of a simulation, called the agenda, and its entries."""

import heapq
import math
from dataclasses import dataclass
from enum import IntEnum, StrEnum

from alloc.problems.missions.simulation import conservation
from alloc.problems.missions.simulation.motion import bring_up_to_date, completion_hour
from alloc.problems.missions.simulation.reports import Message
from alloc.problems.missions.simulation.state import AgentState, Flight, MissionState, TaskState


class Turn(IntEnum):
    """Order of entries at the same hour."""

    COMPLETION = 0
    DEADLINE = 1
    EVENT = 2
    ARRIVAL = 3
    DELIVERY = 4
    RADIO = 5


class Wanted(StrEnum):
    """What a simulation asks for: messages or orders."""

    MESSAGES = "messages"
    ORDERS = "orders"


@dataclass(frozen=True)
class Request:
    """A request of the simulation for messages or orders.

    Attributes
    ----------
    wanted : Wanted
    hour : float
    agents : tuple of str
        Ids of the agents that may send messages or get orders.
    """

    wanted: Wanted
    hour: float
    agents: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Arrival:
    """The end of a flight; void if the agent has been diverted."""

    agent: AgentState
    flight: Flight


@dataclass(frozen=True, eq=False)
class Completion:
    """The completion of a task; void if the task has changed."""

    task: TaskState
    version: int


@dataclass(frozen=True, eq=False)
class Delivery:
    """The delivery of a message."""

    message: Message
    hearers: list[AgentState]


class Agenda:
    """Priority queue of future entries, by hour, then turn, then order of insertion."""

    def __init__(self) -> None:
        self._entries: list[tuple[float, Turn, int, object]] = []
        self._count = 0

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def hour(self) -> float:
        """Hour of the first entry, ``inf`` if there is none."""
        return self._entries[0][0] if self._entries else math.inf

    def push(self, hour: float, turn: Turn, item: object) -> None:
        """Add an entry."""
        self._count += 1
        heapq.heappush(self._entries, (hour, turn, self._count, item))

    def pop(self) -> tuple[Turn, object]:
        """Remove and return the first entry."""
        _, turn, _, item = heapq.heappop(self._entries)
        return turn, item


class Changes:
    """Agents and tasks that have changed, so that arrivals and completions have to be scheduled anew.

    Parameters
    ----------
    state : MissionState
    agenda : Agenda
    """

    def __init__(self, state: MissionState, agenda: Agenda) -> None:
        self._state, self._agenda = state, agenda
        self._agents: dict[int, AgentState] = {}
        self._tasks: dict[int, TaskState] = {}

    def note_agent(self, agent: AgentState, task: TaskState | None = None) -> None:
        """Note an agent, the task where it works, and the task where it worked before."""
        self._agents[agent.index] = agent
        for one in (task, agent.task):
            if one is not None:
                self.note_task(one)

    def note_task(self, task: TaskState) -> None:
        """Note a task."""
        self._tasks[task.index] = task

    def balance(self) -> None:
        """Check the ledgers of all that have changed, and schedule their arrivals and completions."""
        agents, tasks = [*self._agents.values()], [*self._tasks.values()]
        self._agents.clear()
        self._tasks.clear()
        conservation.check(self._state, agents, tasks)
        for agent in agents:
            if agent.flight is not None:
                self._agenda.push(agent.flight.arrives, Turn.ARRIVAL, Arrival(agent, agent.flight))
        for task in tasks:
            hour = math.inf
            if task.workers:
                bring_up_to_date(self._state, task)
                hour = completion_hour(self._state, task)
            if hour < math.inf:
                self._agenda.push(max(hour, self._state.hour), Turn.COMPLETION, Completion(task, task.version))
