"""Records of a compiled mission: agents, tasks, what happens, and all that is neither."""

from functools import cache

import numpy as np


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
    report, reported, seen : int, int, float
        The last report of it, the number of looks when it was written, and the hour.
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
    reported: int
    seen: float
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
    """What was true of an agent at an hour; `task` is where it was going or working.

    Attributes
    ----------
    arrives : float
        Hour at which it is at this task if it goes on, ``-inf`` where it works there.
    ability : float
    """

    hour: float
    status: int
    task: int
    arrives: float
    ability: float
    x: float
    y: float
    z: float
    battery: float


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
    looks : int
        How often somebody looked around, or several did at once.
    lookers, marked : int
        Agents that are to look around, and to decide.
    limit : int
        Reports up to which none is dropped.
    has_twins : int
        Whether there are two reports of an agent at one hour.
    memory : float
        Hours after which policies use nothing that was heard of others; it may be forgotten then.
    oldest : int
        The first report that is not as old.
    left, low, side : float
        Where the grid of cells begins, and how wide cells are.
    columns, rows : int
        Cells of the grid.
    fastest : float
        Highest speed of an agent.
    located : float
        Hour for which the grid says where agents are.
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
    """Return the type of records with the fields of a class."""
    return np.dtype([(name, np.float64 if hint is float else np.int64) for name, hint in kind.__annotations__.items()])
