"""Record types of a compiled mission: agents, tasks, events, agenda entries, reports, and a head for the rest."""

from functools import cache

import numpy as np


class Agent:
    """An agent: see `AgentFacts`, `AgentState` and `Flight`.

    Attributes
    ----------
    order : int
        `STAY`, `TO_TASK` with `order_task`, or `TO_PLACE` with `order_x` and so on.
    flight : int
        Number of the flight in progress, 0 for none; `flights` counts flights, and `flown` says whether one has ended
        at another place than the start.
    task, previous, next : int
        Task where it works, and the agents that arrived there before and after it (a linked list).
    speaks : int
        Whether it sends its next message; set by a policy.
    decides, changed : int
        Whether it has to decide, and whether its arrival has to be rescheduled.
    looked : int
        Number of the turn in which it last sensed.
    report, reported, seen : int, int, float
        Its last report, the value of `Head.looks` when that was written, and the hour.
    known : int
        Row of its knowledge.
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
    reported: int
    seen: float
    known: int


class Task:
    """A task: see `TaskFacts` and `TaskState`; the list of agents that work there has the ends `first` and `last`."""

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
    """An event of the mission; agent and task are indices, `kind` is an index of `EventKind`."""

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
    """An entry of the agenda; `subject` is an index by the kind of turn, `count` the order of insertion."""

    hour: float
    turn: int
    count: int
    subject: int
    version: int


class Report:
    """The state of an agent at an hour; `task` is where it was flying or working.

    It is as long as a cache line, with the fields that every decision reads at the front.

    Attributes
    ----------
    arrives : float
        Hour of its arrival at this task, ``-inf`` if it works there.
    """

    hour: float
    status: int
    task: int
    arrives: float
    x: float
    y: float
    z: float
    battery: float


class Head:
    """Settings of the mission, and counters of the simulation.

    Attributes
    ----------
    span : float
        Diagonal of the area.
    loss_key, burst_key, pace_key : int
        States of the random numbers' hash after the seeds.
    stage : int
        Stage at which `advance` resumes.
    turn : int
        Number of hours so far at which something happened.
    tick : int
        Number of messages that each agent could have sent so far.
    looks : int
        Number of sensing rounds so far.
    lookers, marked : int
        Number of agents that are to sense, and to decide.
    limit : int
        Number of reports beyond which unknown ones are dropped.
    has_twins : int
        Whether there are two reports of an agent at the same hour.
    memory : float
        Hours after which policies no longer use reports of other agents, which may then be forgotten.
    oldest : int
        The first report that is not older than that.
    left, low, side : float
        Corner of the grid, and the side of its cells.
    columns, rows : int
        Size of the grid in cells.
    fastest : float
        Highest speed of an agent.
    located : float
        Hour of the agents' places in the grid.
    unfinished, failed : int
        Number of tasks that are open or to come, and of agents that have failed.
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
    looks: int
    lookers: int
    marked: int
    reports: int
    limit: int
    has_twins: int
    memory: float
    oldest: int
    left: float
    low: float
    side: float
    columns: int
    rows: int
    fastest: float
    located: float
    silences: int
    is_news: int
    deciding: int
    changed_agents: int
    changed_tasks: int
    unfinished: int
    failed: int
    switches: int
    refused: int


@cache
def record_type(kind: type) -> np.dtype[np.void]:
    """Return the structured type with the fields of a class."""
    return np.dtype([(name, np.float64 if hint is float else np.int64) for name, hint in kind.__annotations__.items()])
