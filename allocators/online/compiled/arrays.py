"""A mission and its state as arrays."""

from typing import Any, NamedTuple

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


Records = NDArray[Any]
"""A structured array: one record for each agent, task or event."""

_PLACE = ("f8", (3,))

AGENT_FACTS = np.dtype(
    [("ability", "f8"), ("speed", "f8"), ("rate", "f8"), ("reach", "f8"), ("capacity", "f8"), ("start", *_PLACE)]
)
TASK_FACTS = np.dtype(
    [("workload", "f8"), ("priority", "f8"), ("deadline", "f8"), ("growth", "f8"), ("place", *_PLACE)]
)
EVENT = np.dtype([("hour", "f8"), ("kind", "i8"), ("subject", "i8"), ("amount", "f8")])
AGENT = np.dtype(
    [(name, "i8") for name in ("status", "order", "works", "flies_to", "drawn", "deciding", "looked")]
    + [(name, "f8") for name in ("battery", "length", "departs", "arrives", "distance", "energy")]
    + [(name, *_PLACE) for name in ("position", "source", "goal", "way")]
)
TASK = np.dtype(
    [(name, "i8") for name in ("became", "begun")]
    + [(name, "f8") for name in ("left", "since", "ability", "completes", "closed")]
)


class Setting(NamedTuple):
    """What does not change in a mission; n agents, m tasks, e events.

    Attributes
    ----------
    agent : ndarray of AGENT_FACTS, shape (n,)
        `rate` is energy per distance, `reach` the range, `capacity` the battery at the start.
    task : ndarray of TASK_FACTS, shape (m,)
    event : ndarray of EVENT, shape (e,)
        The timeline; subjects are agents or tasks by index, amounts energy or work where an event has it.
    allowed : ndarray of bool, shape (n, m)
        By lists of tasks and skills.
    area : ndarray, shape (2, 3)
    limits : ndarray, shape (5,)
        End, sensing radius, radio radius, period and loss.
    seeds : ndarray of uint64, shape (2,)
        Of the mission and of the run.
    is_local : bool
    """

    agent: Records
    task: Records
    event: Records
    allowed: BoolArray
    area: FloatArray
    limits: FloatArray
    seeds: NDArray[np.uint64]
    is_local: bool


class State(NamedTuple):
    """Agents and tasks now, and what each agent knows: `MissionState` and `LocalAwareness` as arrays.

    Attributes
    ----------
    agent : ndarray of AGENT, shape (n,)
        `works` and `flies_to` are tasks, -1 for none; `way` is the place of an order to one; `drawn` counts random
        numbers; `deciding` and `looked` say whose turn it is, and who has looked around at this hour.
    task : ndarray of TASK, shape (m,)
        `ability` is that of all who work there, `completes` when it will be done.
    seen, seen_before : ndarray, shape (3, n, m)
        Hour, work left and status of each agent's report of each task; hour -1 where it has none.
    met, met_before : ndarray, shape (6, n, n)
        Hour, status, task and position of each agent's report of each agent.
    here : ndarray, shape (n, 3)
        Where agents are at this hour.
    now : ndarray, shape (1,)
        The hour.
    counts : ndarray of int, shape (5,)
    log : ndarray, shape (rows, 4)
        Hour, kind, agent and task, as far as there are rows.
    """

    agent: Records
    task: Records
    seen: FloatArray
    seen_before: FloatArray
    met: FloatArray
    met_before: FloatArray
    here: FloatArray
    now: FloatArray
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
    limits = [mission.end, mission.sensing, mission.radio.radius, mission.radio.period, mission.radio.loss]
    return Setting(
        agent=_records(
            AGENT_FACTS,
            ability=instance.ability,
            speed=instance.speed,
            rate=instance.agent_energy_per_distance,
            reach=instance.communication_range,
            capacity=instance.battery,
            start=instance.start_position,
        ),
        task=_records(
            TASK_FACTS,
            workload=instance.workload,
            priority=instance.priority,
            deadline=mission.deadline,
            growth=mission.growth,
            place=instance.task_position,
        ),
        event=_timeline(mission),
        allowed=allowed,
        area=np.array(mission.area),
        limits=np.array(limits),
        seeds=np.array([mission.seed, seed], dtype=np.uint64),
        is_local=knowledge is Knowledge.LOCAL,
    )


def _records(kind: np.dtype[np.void], **columns: NDArray[np.float64]) -> Records:
    records = np.zeros(len(next(iter(columns.values()))), dtype=kind)
    for name, values in columns.items():
        records[name] = values
    return records


def _timeline(mission: Mission) -> Records:
    agents, tasks = mission.instance.agent_index, mission.instance.task_index
    rows = [
        (
            event.hour,
            KINDS[event.kind],
            tasks[str(event.task)] if event.agent is None else agents[event.agent],
            event.workload if event.amount is None else event.amount,
        )
        for event in mission.timeline
    ]
    return np.array([(*row[:3], row[3] or 0.0) for row in rows], dtype=EVENT)


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
    agent, task = np.zeros(n, dtype=AGENT), np.zeros(m, dtype=TASK)
    agent["order"], agent["works"], agent["flies_to"] = STAY, -1, -1
    agent["battery"], agent["arrives"] = setting.agent["capacity"], np.inf
    for name in ("position", "source", "goal", "way"):
        agent[name] = setting.agent["start"]
    task["completes"] = task["closed"] = np.inf
    seen, met = np.zeros((3, n, m)), np.zeros((6, n, n))
    seen[0] = met[0] = -1.0
    counts, log = np.zeros(5, dtype=np.intp), np.zeros((rows, 4))
    return State(agent, task, seen, seen.copy(), met, met.copy(), np.zeros((n, 3)), np.zeros(1), counts, log)
