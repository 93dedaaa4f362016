"""A mission and its state as arrays."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.problems import Mission, RefusedError
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.missions.events import EventKind
from alloc.problems.vocabulary import EUCLIDEAN, Knowledge

ABSENT, IDLE, FLYING, WORKING, AWAY, FAILED = range(6)
"""What an agent does: `AgentStatus` by number."""

TO_COME, OPEN, DONE, MISSED, CANCELLED = range(5)
"""What has become of a task: `TaskStatus` by number."""

STAY, PLACE = -1, -2
"""An order to stay, and one to a place; others are tasks."""

JOINS, FAILS, RECALLED, RETURNS, RECHARGES, APPEARS, CANCELS, CHANGES = range(8)

KINDS = {
    EventKind.AGENT_JOINS: JOINS,
    EventKind.AGENT_FAILS: FAILS,
    EventKind.AGENT_RECALLED: RECALLED,
    EventKind.AGENT_RETURNS: RETURNS,
    EventKind.AGENT_RECHARGES: RECHARGES,
    EventKind.TASK_APPEARS: APPEARS,
    EventKind.TASK_CANCELLED: CANCELS,
    EventKind.TASK_CHANGES: CHANGES,
}

SWITCHES, MESSAGES, HEARD, TICK, LOGGED = range(5)
"""Entries of `State.counts`; heard: messages that reached somebody, once for each."""

ORDERED, ARRIVED, COMPLETED, MISSED_IT = range(4)
"""Kinds of rows in a log."""


class Setting(NamedTuple):
    """What does not change in a mission; n agents, m tasks, e events.

    Attributes
    ----------
    ability, speed, rate, reach : ndarray, shape (n,)
        `rate` is energy per distance, `reach` the range.
    allowed : ndarray of bool, shape (n, m)
        By lists of tasks and skills.
    start, place : ndarray, shape (n, 3) and (m, 3)
    capacity : ndarray, shape (n,)
        Battery at the start.
    workload, priority, deadline, growth : ndarray, shape (m,)
    hour, kind, subject, amount : ndarray, shape (e,)
        The timeline; agents and tasks by index, energy or work where an event has it.
    area : ndarray, shape (2, 3)
    limits : ndarray, shape (5,)
        End, sensing radius, radio radius, period and loss.
    seeds : ndarray of uint64, shape (2,)
        Of the mission and of the run.
    is_local : bool
    """

    ability: FloatArray
    speed: FloatArray
    rate: FloatArray
    reach: FloatArray
    allowed: BoolArray
    start: FloatArray
    place: FloatArray
    capacity: FloatArray
    workload: FloatArray
    priority: FloatArray
    deadline: FloatArray
    growth: FloatArray
    hour: FloatArray
    kind: IntArray
    subject: IntArray
    amount: FloatArray
    area: FloatArray
    limits: FloatArray
    seeds: NDArray[np.uint64]
    is_local: bool


class State(NamedTuple):
    """Agents and tasks now, and what each agent knows: `MissionState` and `LocalAwareness` as arrays.

    Attributes
    ----------
    now : ndarray, shape (1,)
        The hour.
    status, order, works, flies_to, drawn : ndarray of int, shape (n,)
        `works` and `flies_to` are tasks, -1 for none; `drawn` counts random numbers.
    position, source, goal, way : ndarray, shape (n, 3)
        `way` is the place of an order to one.
    battery, length, departs, arrives, distance, energy : ndarray, shape (n,)
    became : ndarray of int, shape (m,)
        What has become of each task.
    left, since, ability, completes, closed : ndarray, shape (m,)
    begun : ndarray of bool, shape (m,)
    seen, seen_before : ndarray, shape (n, m, 3)
        Hour, work left and status of each agent's report of each task; hour -1 where it has none.
    met, met_before : ndarray, shape (n, n, 6)
        Hour, status, task and position of each agent's report of each agent.
    near : ndarray of bool, shape (n, n)
        Who hears whom.
    deciding, looked : ndarray of bool, shape (n,)
    counts : ndarray of int, shape (5,)
    log : ndarray, shape (rows, 4)
        Hour, kind, agent and task, as far as there are rows.
    """

    now: FloatArray
    status: IntArray
    order: IntArray
    works: IntArray
    flies_to: IntArray
    drawn: IntArray
    position: FloatArray
    source: FloatArray
    goal: FloatArray
    way: FloatArray
    battery: FloatArray
    length: FloatArray
    departs: FloatArray
    arrives: FloatArray
    distance: FloatArray
    energy: FloatArray
    became: IntArray
    left: FloatArray
    since: FloatArray
    ability: FloatArray
    completes: FloatArray
    closed: FloatArray
    begun: BoolArray
    seen: FloatArray
    seen_before: FloatArray
    met: FloatArray
    met_before: FloatArray
    near: BoolArray
    deciding: BoolArray
    looked: BoolArray
    counts: IntArray
    log: FloatArray


def setting_of(mission: Mission, knowledge: Knowledge, seed: int) -> Setting:
    """Return a mission as arrays.

    Raises
    ------
    RefusedError
        If the compiled simulation cannot handle it.
    """
    instance = mission.instance
    _refuse(mission)
    allowed = np.ones((instance.n, instance.m), dtype=np.bool_)
    for agent, tasks in enumerate(instance.eligible_tasks or ()):
        if tasks is not None:
            allowed[agent] = False
            allowed[agent, tasks] = True
    amounts = [event.workload if event.amount is None else event.amount for event in mission.timeline]
    subjects = [
        instance.task_index[str(event.task)] if event.agent is None else instance.agent_index[event.agent]
        for event in mission.timeline
    ]
    return Setting(
        ability=instance.ability,
        speed=instance.speed,
        rate=instance.agent_energy_per_distance,
        reach=instance.communication_range,
        allowed=allowed,
        start=instance.start_position,
        place=instance.task_position,
        capacity=instance.battery,
        workload=instance.workload,
        priority=instance.priority,
        deadline=mission.deadline,
        growth=mission.growth,
        hour=np.array([event.hour for event in mission.timeline]),
        kind=np.array([KINDS[event.kind] for event in mission.timeline]),
        subject=np.array(subjects, dtype=np.intp),
        amount=np.array([0.0 if amount is None else amount for amount in amounts]),
        area=np.array(mission.area),
        limits=np.array([mission.end, mission.sensing, mission.radio.radius, mission.radio.period, mission.radio.loss]),
        seeds=np.array([mission.seed, seed], dtype=np.uint64),
        is_local=knowledge is Knowledge.LOCAL,
    )


def _refuse(mission: Mission) -> None:
    instance = mission.instance
    reasons = {
        "distances other than euclidean": instance.metric != EUCLIDEAN or instance.distances is not None,
        "unknown places": bool(np.isnan(instance.start_position).any() or np.isnan(instance.task_position).any()),
        "agents that return": bool(instance.returns.any()),
        "a pace": mission.pace is not None,
        "bursts and delays of the radio": mission.radio.burst is not None or mission.radio.delay > 0,
        "silence": any(event.kind is EventKind.RADIO_SILENT for event in mission.events),
    }
    found = [reason for reason, holds in reasons.items() if holds]
    if found:
        raise RefusedError(f"the compiled simulation has no {', no '.join(found)}; use the reference simulation")


def state_of(setting: Setting, rows: int) -> State:
    """Return the state before the first event; `rows` that are logged at the most."""
    n, m = setting.allowed.shape
    whole = [np.full(n, value, dtype=np.intp) for value in (ABSENT, STAY, -1, -1, 0)]
    seen, met = np.zeros((n, m, 3)), np.zeros((n, n, 6))
    seen[:, :, 0] = met[:, :, 0] = -1.0
    return State(
        np.zeros(1),
        *whole,
        *(setting.start.copy() for _ in range(4)),
        setting.capacity.copy(),
        *(np.zeros(n) for _ in range(2)),
        np.full(n, np.inf),
        *(np.zeros(n) for _ in range(2)),
        np.full(m, TO_COME, dtype=np.intp),
        *(np.zeros(m) for _ in range(3)),
        *(np.full(m, np.inf) for _ in range(2)),
        np.zeros(m, dtype=np.bool_),
        seen,
        seen.copy(),
        met,
        met.copy(),
        np.zeros((n, n), dtype=np.bool_),
        *(np.zeros(n, dtype=np.bool_) for _ in range(2)),
        np.zeros(5, dtype=np.intp),
        np.zeros((rows, 4)),
    )
