"""Present state of agents and tasks, and their ledgers of distance, energy and work.

Agents and tasks are updated only when something changes for them, not at every event: `since` is the hour of a task's
last update, and a flight is booked when it ends.
"""

import math
from dataclasses import dataclass, field
from enum import StrEnum

from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.places import (
    Distances,
    Place,
    Position,
    bases_of_agents,
    starting_places,
    task_places,
)


class AgentStatus(StrEnum):
    """Status of an agent."""

    ABSENT = "absent"
    IDLE = "idle"
    FLYING = "flying"
    WORKING = "working"
    AWAY = "away"
    FAILED = "failed"


ACTIVE = frozenset({AgentStatus.IDLE, AgentStatus.FLYING, AgentStatus.WORKING})
"""Statuses of agents in the mission, which sense, communicate and take orders."""


class TaskStatus(StrEnum):
    """Status of a task."""

    TO_COME = "to come"
    OPEN = "open"
    DONE = "done"
    MISSED = "missed"
    CANCELLED = "cancelled"


@dataclass(frozen=True, slots=True)
class AgentFacts:
    """Constant properties of an agent.

    Attributes
    ----------
    id : str
    ability, speed, energy_per_distance, range : float
        A speed of ``inf`` means that flights take no time, a range of ``inf`` that it is unlimited.
    start : Place
    returns : bool
        Whether it must always be able to fly home, and does so at the end if it has flown at all.
    base : Place or None
        Its home; None for its start.
    skills : frozenset of str
    tasks : frozenset of str, or None
        Ids of the tasks that it may do; None for all.
    """

    id: str
    ability: float
    speed: float
    energy_per_distance: float
    range: float
    start: Place
    returns: bool
    base: Place | None
    skills: frozenset[str]
    tasks: frozenset[str] | None

    @property
    def home(self) -> Place:
        """Place to which it returns, if it does."""
        return self.start if self.base is None else self.base


@dataclass(frozen=True, slots=True)
class TaskFacts:
    """Constant properties of a task: see `Mission` and `Instance`."""

    id: str
    place: Place
    priority: float
    appears: float
    deadline: float
    growth: float
    needs: frozenset[str]


@dataclass(frozen=True, slots=True)
class Order:
    """An order of an agent: go to a task and work there, go to a place, or, with neither, stay.

    Attributes
    ----------
    task : str or None
        Id of the task.
    position : tuple of float, or None
        Three coordinates of a place, instead of a task.
    """

    task: str | None = None
    position: Position | None = None


STAY = Order()


@dataclass(frozen=True, slots=True)
class Flight:
    """A flight in progress; `task` is None for a flight to a place."""

    source: Place
    goal: Place
    task: "TaskState | None"
    distance: float
    departs: float
    arrives: float

    def share(self, hour: float) -> float:
        """Return the share of the distance flown by an hour."""
        length = self.arrives - self.departs
        return 1.0 if length <= 0 else min(1.0, max(0.0, (hour - self.departs) / length))


@dataclass(eq=False, slots=True)
class AgentState:
    """Present state of an agent.

    Attributes
    ----------
    index : int
    facts : AgentFacts
    place : Place
        Its place, or the source of its flight.
    battery : float
        Energy left at that place.
    capacity : float
        Initial energy plus recharges.
    status : AgentStatus
    order : Order
        Its last order.
    flight : Flight or None
    task : TaskState or None
        Task where it works.
    distance, energy : float
        Distance flown so far, and the energy used.
    has_flown : bool
        Whether it has ended a flight at another place than its start.
    """

    index: int
    facts: AgentFacts
    place: Place
    battery: float
    capacity: float
    status: AgentStatus = AgentStatus.ABSENT
    order: Order = STAY
    flight: Flight | None = None
    task: "TaskState | None" = None
    distance: float = 0.0
    energy: float = 0.0
    has_flown: bool = False


@dataclass(eq=False, slots=True)
class TaskState:
    """Present state of a task; all work that appeared, grew or was added is left, done, cancelled or missed.

    Attributes
    ----------
    index : int
    facts : TaskFacts
    workload : float
        Initial work when it appears.
    status : TaskStatus
    workers : dict
        Agents that work there, by index, in the order of their arrival.
    left, since : float
        Work left, and the hour of that value.
    begun : bool
        Whether an agent has worked there, so that it no longer grows.
    appeared, grown, done, cancelled, missed : float
        Total amounts of work.
    closed : float
        Hour at which it was done, missed or cancelled.
    version : int
        Incremented whenever the hour of its completion may change.
    """

    index: int
    facts: TaskFacts
    workload: float
    status: TaskStatus = TaskStatus.TO_COME
    workers: dict[int, AgentState] = field(default_factory=dict)
    left: float = 0.0
    since: float = 0.0
    begun: bool = False
    appeared: float = 0.0
    grown: float = 0.0
    done: float = 0.0
    cancelled: float = 0.0
    missed: float = 0.0
    closed: float = math.inf
    version: int = 0


class MissionState:
    """Present state of all agents and tasks of a mission.

    Parameters
    ----------
    mission : Mission

    Attributes
    ----------
    mission : Mission
    distances : Distances
    hour : float
    agents : list of AgentState
    tasks : list of TaskState
    switches : int
        Number of orders that sent a flying or working agent elsewhere while its task had work left.
    """

    def __init__(self, mission: Mission) -> None:
        instance = mission.instance
        self.mission, self.hour, self.switches = mission, 0.0, 0
        self.distances = Distances(instance)
        allowed = instance.allowed_tasks or (None,) * instance.n
        skills, needs = instance.skills or ((),) * instance.n, instance.needs or ((),) * instance.m
        rows = zip(
            instance.agent_ids,
            instance.ability.tolist(),
            instance.speed.tolist(),
            instance.agent_energy_per_distance.tolist(),
            instance.communication_range.tolist(),
            starting_places(instance),
            instance.returns.tolist(),
            bases_of_agents(instance),
            map(frozenset, skills),
            (None if some is None else frozenset(instance.task_ids[j] for j in some.tolist()) for some in allowed),
            strict=True,
        )
        facts = [AgentFacts(*row) for row in rows]
        batteries = instance.battery.tolist()
        self.agents = [AgentState(i, fact, fact.start, batteries[i], batteries[i]) for i, fact in enumerate(facts)]
        places, workload = task_places(instance), instance.workload.tolist()
        columns = (instance.priority, mission.appears, mission.deadline, mission.growth)
        priority, appears, deadline, growth = (column.tolist() for column in columns)
        self.tasks = [
            TaskState(
                j,
                TaskFacts(name, places[j], priority[j], appears[j], deadline[j], growth[j], frozenset(needs[j])),
                workload[j],
            )
            for j, name in enumerate(instance.task_ids)
        ]

    def agent(self, name: str | None) -> AgentState:
        """Return an agent by its id."""
        return self.agents[self.mission.instance.agent_index[str(name)]]

    def task(self, name: str | None) -> TaskState:
        """Return a task by its id."""
        return self.tasks[self.mission.instance.task_index[str(name)]]
