"""The state of a compiled mission: records of agents and tasks, and arrays of what agents know."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems.fields import BoolArray, FloatArray, IntArray

ABSENT, IDLE, FLYING, WORKING, AWAY, FAILED = range(6)
"""What an agent does, in the order of `AgentStatus`."""

TO_COME, OPEN, DONE, MISSED, CANCELLED = range(5)
"""What has become of a task, in the order of `TaskStatus`."""

STAY, TO_TASK, TO_PLACE = range(3)
"""What an order is: to stay, to go to a task, or to a place."""

OVER, MESSAGES, ORDERS = range(3)
"""What a mission waits for: nothing any more, messages to be sent, or orders."""

NOBODY = -1
"""No agent, no task, no report; what is known of a closed task is minus its status instead of the work left."""


class Agent:
    """An agent: see `AgentFacts`, `AgentState` and `Flight`.

    Attributes
    ----------
    order : int
        `STAY`, `TO_TASK` with `order_task`, or `TO_PLACE` with `order_x` and so on.
    flight : int
        Number of the flight that goes on, 0 for none; `flights` counts them, and `flown` says whether one has ended
        anywhere but where it began.
    task, previous, next : int
        Where it works, and who came there before and after it.
    speaks : int
        Whether it sends the message that it can send now; a policy sets it.
    decides, changed : int
        Whether it is to get an order; whether its flight may end at another hour.
    looked : int
        Number of the turn in which it looked around.
    report : int
        The last one of it.
    known : int
        Row of what it knows.
    """

    ability: float
    speed: float
    energy_per_distance: float
    range: float
    home_x: float
    home_y: float
    home_z: float
    returns: int
    status: int
    x: float
    y: float
    z: float
    battery: float
    capacity: float
    order: int
    order_task: int
    order_x: float
    order_y: float
    order_z: float
    flight: int
    flights: int
    flown: int
    goal_x: float
    goal_y: float
    goal_z: float
    length: float
    departs: float
    arrives: float
    task: int
    previous: int
    next: int
    distance: float
    energy: float
    messages: int
    bytes: int
    speaks: int
    decides: int
    changed: int
    looked: int
    report: int
    known: int


class Task:
    """A task: see `TaskFacts` and `TaskState`; `first` and `last` work there, `changed` is as of an agent."""

    workload: float
    x: float
    y: float
    z: float
    priority: float
    appears: float
    deadline: float
    growth: float
    status: int
    first: int
    last: int
    left: float
    since: float
    begun: int
    appeared: float
    grown: float
    done: float
    cancelled: float
    missed: float
    closed: float
    version: int
    changed: int


class Happening:
    """An event of the mission; agent and task are numbers, `kind` counts through `EventKind`."""

    hour: float
    kind: int
    agent: int
    task: int
    amount: float
    x: float
    y: float
    z: float
    radius: float
    until: float


class Entry:
    """An entry of the agenda: hour, turn, and what it is about; `count` says in which order they were made."""

    hour: float
    turn: int
    count: int
    subject: int
    version: int


class Report:
    """What was true of an agent; `task` is where it was going or working."""

    status: int
    x: float
    y: float
    z: float
    battery: float
    task: int


class Head:
    """All that is neither an agent's nor a task's: settings of the mission, and counters.

    Attributes
    ----------
    span : float
        Diagonal of the area.
    loss_key, burst_key, pace_key : int
        States of the hash of chances after the seeds.
    stage : int
        Where `advance` goes on.
    turn : int
        Counts through all hours at which something happens.
    tick : int
        Messages that each agent could have sent.
    unfinished, failed : int
        Tasks that are open or to come, agents that have failed.
    """

    end: float
    span: float
    is_local: int
    is_manhattan: int
    sensing: float
    radius: float
    period: float
    loss: float
    delay: float
    has_burst: int
    burst_good: float
    burst_bad: float
    burst_loss_good: float
    burst_loss_bad: float
    has_pace: int
    pace_low: float
    pace_high: float
    pace_period: float
    loss_key: int
    burst_key: int
    pace_key: int
    hour: float
    stage: int
    turn: int
    tick: int
    entries: int
    count: int
    reports: int
    silences: int
    is_news: int
    deciding: int
    changed_agents: int
    changed_tasks: int
    unfinished: int
    failed: int
    switches: int
    refused: int


def record_type(kind: type) -> np.dtype[np.void]:
    """Return the type of records with the fields of a class."""
    return np.dtype([(name, np.float64 if hint is float else np.int64) for name, hint in kind.__annotations__.items()])


class MissionArrays(NamedTuple):
    """A mission as it goes on, for compiled code.

    Row r of what is known is that of agent r, or the only one where all know all. n agents, m tasks, k messages of each
    agent on the air at once at the most. Rows of what is known have columns behind these, of which nothing is known.

    Attributes
    ----------
    head : records, shape (1,)
    agents, tasks : records, shape (n,) and (m,)
    events, agenda, reports : records
    renumbered : ndarray of int, shape (reports,)
        New numbers of reports, when those are dropped that nobody knows any more.
    allowed : ndarray of bool, shape (n, m)
        Which agent may do which task, by its list and its skills.
    area : ndarray, shape (2, 3)
        Least and largest coordinates of all places, which all know.
    sites : ndarray, shape (3, m)
        Where tasks are.
    places : ndarray, shape (3, n)
        Where agents are, in the turn in which somebody looks around.
    visible : ndarray of bool, shape (n,)
        Which agents are in the mission then.
    now : ndarray, shape (m,)
        What is seen of tasks then.
    looks, speaks : ndarray of bool, shape (n,)
        Who is to look around, and who sends a message.
    numbers : ndarray of int, shape (n,)
        Last report of each agent.
    task_hour, task_left : ndarray, shape (rows, m)
        Hour at which an agent's knowledge of a task was true, -1 where it knows nothing, and the work left then.
    agent_hour : ndarray, shape (rows, n)
    agent_report : ndarray of int, shape (rows, n)
        The hour, and the number of the report of each agent.
    sent_task_hour, sent_task_left, sent_agent_hour, sent_agent_report : ndarray, shape (k, n, m) or (k, n, n)
        The same, as it was when it was sent.
    heard : ndarray of bool, shape (k, n, n)
        Whether what an agent (second) sent is heard by another (third).
    link_number, link_bad : ndarray of int, shape (n, n)
        State of each link at a message, with losses in bursts.
    silences : ndarray of int
        Events by which there is silence.
    deciding, changed_agents, changed_tasks : ndarray of int
        Agents that are to get orders now; what the agenda has to take notice of.
    """

    head: Sequence[Head]
    agents: Sequence[Agent]
    tasks: Sequence[Task]
    events: Sequence[Happening]
    agenda: Sequence[Entry]
    reports: Sequence[Report]
    renumbered: NDArray[np.int32]
    allowed: BoolArray
    area: FloatArray
    sites: FloatArray
    places: FloatArray
    visible: BoolArray
    now: FloatArray
    looks: BoolArray
    speaks: BoolArray
    numbers: NDArray[np.int32]
    task_hour: FloatArray
    task_left: FloatArray
    agent_hour: FloatArray
    agent_report: NDArray[np.int32]
    sent_task_hour: FloatArray
    sent_task_left: FloatArray
    sent_agent_hour: FloatArray
    sent_agent_report: NDArray[np.int32]
    heard: BoolArray
    link_number: IntArray
    link_bad: IntArray
    silences: IntArray
    deciding: IntArray
    changed_agents: IntArray
    changed_tasks: IntArray
