"""Conversion of a mission into arrays for compiled code, and its measures at the end."""

import math
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.chance import first_key, keyed
from alloc.allocators.missions.grid import divide
from alloc.allocators.missions.layout import NOBODY, MissionArrays
from alloc.allocators.missions.records import Agent, Entry, Happening, Head, Report, Task, record_type
from alloc.problems.errors import RefusedError
from alloc.problems.fields import BoolArray, FloatArray
from alloc.problems.missions.chance import BURST, LOSS, PACE
from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.radio import Radio
from alloc.problems.missions.simulation.agenda import Turn
from alloc.problems.missions.simulation.measures import DecisionTimes, MissionResult, measured
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import AgentStatus, TaskStatus
from alloc.problems.vocabulary import GEOGRAPHIC, MANHATTAN, Knowledge

Records = NDArray[np.void]

MAX_KNOWN = 50_000_000
"""Limit on the number of values that agents know of tasks, including copies in messages in transit."""

MAX_PAIRS = 1_000_000_000
"""The same limit for values on other agents; each takes 4 bytes of memory once it is known."""

MAX_REPORTS = 4_000_000
"""Capacity for reports of agents, unless `REPORTS_EACH` per agent is more."""

REPORTS_EACH = 400

MIN_COLUMNS, COLUMNS = 40, 8
"""Minimum number of columns of knowledge arrays, and the number of which it is a multiple, for vectorisation."""

EMPTY = ("reports", "renumbered", "known_", "sent_", "sender", "links")
"""Prefixes of the names of arrays that are empty at hour 0, so that pages are allocated only when written."""


def pack(mission: Mission, knowledge: Knowledge | str | None = None, memory: float = math.inf) -> MissionArrays:
    """Return a mission at hour 0 for compiled code; `begun` prepares it for a run.

    Parameters
    ----------
    mission : Mission
    knowledge : {"full", "local"}, optional
        By default that of the mission.
    memory : float
        Hours after which the policy no longer uses reports of other agents. They are forgotten then, but still count in
        the bytes of messages.

    Raises
    ------
    RefusedError
        If distances are geographic or given by a table, or the mission is too large.
    """
    instance = mission.instance
    if instance.metric == GEOGRAPHIC or instance.distances is not None:
        raise RefusedError("the compiled simulation supports neither geographic distances nor distance tables")
    known = mission.knowledge if knowledge is None else Knowledge(knowledge)
    n, m = instance.n, instance.m
    rows, slots = (n, _on_the_air(mission.radio)) if known is Knowledge.LOCAL else (1, 0)
    if max((rows + slots * n) * m / MAX_KNOWN, (rows + slots * n) * n / MAX_PAIRS) > 1:
        raise RefusedError(f"{n} agents and {m} tasks are too many for the compiled simulation with local knowledge")
    tasks, events = _tasks(mission), _events(mission)
    deadlines = np.flatnonzero(np.isfinite(mission.deadline))
    reports = n + 1
    if known is Knowledge.LOCAL:
        reports = min(2 * (rows + slots) * n + 2 * n + 1025, max(MAX_REPORTS, REPORTS_EACH * n))
    head = _head(mission, known, len(events) + len(deadlines) + (known is Knowledge.LOCAL))
    head["memory"], head["limit"] = memory, min(reports, 32 * n + 1024)
    cells = divide(mission, head)
    parts = {
        "head": head,
        "agents": _agents(mission, known),
        "tasks": tasks,
        "events": events,
        "agenda": _agenda(mission, deadlines, known, slots),
        "reports": np.zeros(reports, record_type(Report)),
        "renumbered": np.zeros(reports, np.int32),
        "allowed": _allowed(mission),
        "area": np.array(mission.area),
        "sites": np.ascontiguousarray(instance.task_position.T),
        "task_now": np.zeros(m),
        "places": np.ascontiguousarray(instance.start_position.T),
        "cells": cells,
        "in_cells": np.arange(n, dtype=np.int32),
        "is_near": np.zeros(max(n, m), np.bool_),
        "near": np.zeros(max(n, m), np.int32),
        "speaks": np.zeros(n, np.bool_),
        "speakers": np.zeros(n, np.int32),
        "speaker_places": np.zeros((3, n)),
        "speaker_cells": np.zeros_like(cells),
        **_knowledge(n, m, rows, slots, words=-(-n // 64) if memory < mission.end else 0),
        "links": np.zeros((n, n) if mission.radio.burst else (0, 0), np.int32),
        "silences": np.zeros(len(events), np.intp),
        **{name: np.zeros(n, np.intp) for name in ("lookers", "marked", "deciding", "changed_agents")},
        "changed_tasks": np.zeros(m, np.intp),
    }
    return MissionArrays(**{name: _by_attribute(part) for name, part in parts.items()})  # type: ignore[arg-type]


def _knowledge(n: int, m: int, rows: int, slots: int, words: int) -> dict[str, FloatArray]:
    """Return the arrays for agents' knowledge and for messages in transit."""
    wide = max(MIN_COLUMNS, -(-m // COLUMNS) * COLUMNS)
    known: dict[str, NDArray[np.generic]] = {
        "task_hour": np.full((rows, wide), -1.0),
        "task_left": np.zeros((rows, wide)),
        "known": np.zeros(rows, np.int32),
        "known_report": np.zeros((rows, n), np.int32),
        "heard_of": np.zeros((rows, words), np.intp),
        "sent_task_hour": np.zeros((slots, n, wide)),
        "sent_task_left": np.zeros((slots, n, wide)),
        "sent": np.zeros((slots, n), np.int32),
        "sent_report": np.zeros((slots, n, n), np.int32),
        "sent_of": np.zeros((slots, n, words), np.intp),
        "senders": np.zeros((slots, n), np.int32),
        "first_sender": np.zeros((slots, n), np.intp),
        "sender": np.zeros((slots, n * n), np.int32),
    }
    return cast(dict[str, FloatArray], known)


def _on_the_air(radio: Radio) -> int:
    """Return the largest number of an agent's messages in transit at once."""
    return 1 if radio.delay == 0 else int(radio.delay // radio.period) + 2


def begun(packed: MissionArrays, seed: int = 0) -> MissionArrays:
    """Return a copy of a packed mission for one run.

    Parameters
    ----------
    packed : MissionArrays
    seed : int
        Seed of message losses, together with that of the mission.
    """
    parts = {name: _fresh(part) if name.startswith(EMPTY) else _copied(part) for name, part in packed._asdict().items()}
    state = MissionArrays(**parts)  # type: ignore[arg-type]
    head = state.head[0]
    head.loss_key, head.burst_key = keyed(head.loss_key, seed), keyed(head.burst_key, seed)
    return state


def _copied(part: Records | FloatArray) -> Records | FloatArray:
    """Return a copy of an array; numpy would copy records field by field."""
    if part.dtype.names is None:
        return part.copy()
    return _by_attribute(cast(Records, part.view(np.ndarray).view(np.uint8).copy().view(part.dtype)))


def _fresh(part: Records | FloatArray) -> Records | FloatArray:
    """Return an array of zeros like another one."""
    return _by_attribute(cast(FloatArray, np.zeros(part.shape, part.dtype)))


def records(part: object) -> Records:
    """Return records of `MissionArrays` as a structured array, with columns by name."""
    return cast(Records, part)


def _by_attribute(part: Records | FloatArray) -> Records | FloatArray:
    """Return an array; if structured, as a record array, with its fields as attributes."""
    return part if part.dtype.names is None else part.view(np.recarray)


def _head(mission: Mission, knowledge: Knowledge, entries: int) -> Records:
    radio, pace, burst = mission.radio, mission.pace, mission.radio.burst
    head = np.zeros(1, record_type(Head))
    values: dict[str, float] = {
        "end": mission.end,
        "span": math.dist(*mission.area),
        "is_local": knowledge is Knowledge.LOCAL,
        "is_manhattan": mission.instance.metric == MANHATTAN,
        "sensing": mission.sensing,
        **{name: getattr(radio, name) for name in ("radius", "period", "loss", "delay")},
        "has_burst": burst is not None,
        "has_pace": pace is not None,
        "loss_key": keyed(first_key(LOSS), mission.seed),
        "burst_key": keyed(first_key(BURST), mission.seed),
        "pace_key": keyed(first_key(PACE), mission.seed),
        "unfinished": mission.instance.m,
        "entries": entries,
        "count": entries,
        "reports": 1,
    }
    if burst is not None:
        values |= {f"burst_{name}": getattr(burst, name) for name in ("good", "bad", "loss_good", "loss_bad")}
    if pace is not None:
        values |= {f"pace_{name}": getattr(pace, name) for name in ("low", "high", "period")}
    for name, value in values.items():
        head[name] = value
    return head


def _agents(mission: Mission, knowledge: Knowledge) -> Records:
    instance = mission.instance
    agents = np.zeros(instance.n, record_type(Agent))
    agents["ability"], agents["speed"], agents["returns"] = instance.ability, instance.speed, instance.returns
    agents["energy_per_distance"] = instance.agent_energy_per_distance
    agents["range"] = instance.communication_range
    has_base = instance.return_base >= 0
    for axis, name in enumerate("xyz"):
        agents[name] = agents[f"home_{name}"] = instance.start_position[:, axis]
        agents[f"home_{name}"][has_base] = instance.bases.position[instance.return_base[has_base], axis]
    agents["battery"] = agents["capacity"] = instance.battery
    for name in ("task", "previous", "next", "order_task"):
        agents[name] = NOBODY
    agents["speaks"], agents["seen"] = 1, -1.0
    agents["known"] = np.arange(instance.n) if knowledge is Knowledge.LOCAL else 0
    return agents


def _tasks(mission: Mission) -> Records:
    instance = mission.instance
    tasks = np.zeros(instance.m, record_type(Task))
    tasks["workload"], tasks["priority"] = instance.workload, instance.priority
    for axis, name in enumerate("xyz"):
        tasks[name] = instance.task_position[:, axis]
    for name in ("appears", "deadline", "growth"):
        tasks[name] = getattr(mission, name)
    tasks["first"] = tasks["last"] = NOBODY
    tasks["closed"] = np.inf
    return tasks


def _events(mission: Mission) -> Records:
    kinds = {kind: number for number, kind in enumerate(EventKind)}
    agents, tasks = mission.instance.agent_index, mission.instance.task_index
    rows = []
    for event in mission.timeline:
        agent = NOBODY if event.agent is None else agents[event.agent]
        task = NOBODY if event.task is None else tasks[event.task]
        area = *(event.center or (0.0, 0.0, 0.0)), event.radius or 0.0
        rows.append((event.hour, kinds[event.kind], agent, task, _amount(event), *area, event.until or 0.0))
    return np.array(rows, record_type(Happening))


def _amount(event: Event) -> float:
    """Return the amount of a recharge, or the new work left of a task."""
    return event.amount or event.workload or 0.0


def _agenda(mission: Mission, deadlines: NDArray[np.intp], knowledge: Knowledge, slots: int) -> Records:
    """Return the agenda at hour 0: events, deadlines, and the first messages."""
    rows = [(event.hour, int(Turn.EVENT), number) for number, event in enumerate(mission.timeline)]
    rows += [(float(mission.deadline[task]), int(Turn.DEADLINE), task) for task in deadlines.tolist()]
    if knowledge is Knowledge.LOCAL:
        rows.append((0.0, int(Turn.RADIO), 0))
    least = len(rows) + slots + mission.instance.n + mission.instance.m
    agenda = np.zeros(2 * least + 64, record_type(Entry))
    ordered = sorted((hour, turn, count, item) for count, (hour, turn, item) in enumerate(rows, 1))
    agenda[: len(rows)] = np.array([(*entry, 0) for entry in ordered], agenda.dtype)
    return agenda


def _allowed(mission: Mission) -> BoolArray:
    instance = mission.instance
    allowed = np.ones((instance.n, instance.m), np.bool_)
    for agent, some in enumerate(instance.allowed_tasks or ()):
        if some is not None:
            allowed[agent] = np.isin(np.arange(instance.m), some)
    for agent, skills in enumerate(instance.skills or ((),) * instance.n if instance.needs else ()):
        allowed[agent] &= [set(needs) <= set(skills) for needs in instance.needs or ()]
    return allowed


def measure(mission: Mission, state: MissionArrays, policy: str, seed: int = 0) -> MissionResult:
    """Return the measures of a finished compiled mission; decisions and their times are not measured.

    Parameters
    ----------
    mission : Mission
        The mission that was packed.
    state : MissionArrays
    policy : str
        Name of the policy.
    seed : int
        Seed of the run.
    """
    head = state.head[0]
    simulation = Simulation(mission, Knowledge.LOCAL if head.is_local else Knowledge.FULL, seed, aware=False)
    for agent, flown in zip(simulation.state.agents, state.agents, strict=True):
        agent.status = tuple(AgentStatus)[flown.status]
        agent.battery, agent.capacity = float(flown.battery), float(flown.capacity)
        agent.distance, agent.energy = float(flown.distance), float(flown.energy)
    for task, worked in zip(simulation.state.tasks, state.tasks, strict=True):
        task.status, task.begun = tuple(TaskStatus)[worked.status], bool(worked.begun)
        task.left, task.closed = float(worked.left), float(worked.closed)
    simulation.state.switches = int(head.switches)
    simulation.messages = records(state.agents)["messages"].tolist()
    simulation.bytes = records(state.agents)["bytes"].tolist()
    return replace(measured(simulation, policy, seed, DecisionTimes()), orders_refused=int(head.refused))
