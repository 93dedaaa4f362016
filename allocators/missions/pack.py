"""A mission as arrays for compiled code, and its measures when it is over."""

import math
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions import layout
from alloc.allocators.missions.chance import first_key, keyed
from alloc.allocators.missions.layout import NOBODY, MissionArrays, record_type
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

MOST_KNOWN = 50_000_000
"""Pairs of who knows and what is known up to which a mission is simulated."""


LEAST_COLUMNS, COLUMNS = 40, 8
"""What is known stands in rows of a multiple of so many columns, as processors compare several at once."""


def pack(mission: Mission, knowledge: Knowledge | str | None = None) -> MissionArrays:
    """Return a mission at hour 0 for compiled code; `begun` makes it ready for a run.

    Parameters
    ----------
    mission : Mission
    knowledge : {"full", "local"}, optional
        That of the mission by default.

    Raises
    ------
    RefusedError
        If its distances are geographic or given by a table, or it is too large.
    """
    instance = mission.instance
    if instance.metric == GEOGRAPHIC or instance.distances is not None:
        raise RefusedError("the compiled simulation has neither geographic distances nor tables of distances")
    known = mission.knowledge if knowledge is None else Knowledge(knowledge)
    n, m = instance.n, instance.m
    wide_n, wide_m = (max(LEAST_COLUMNS, -(-count // COLUMNS) * COLUMNS) for count in (n, m))
    rows, slots = (n, _on_the_air(mission.radio)) if known is Knowledge.LOCAL else (1, 0)
    if (rows + slots * n) * (n + m) > MOST_KNOWN:
        raise RefusedError(f"{n} agents and {m} tasks are too many for the compiled simulation with local knowledge")
    agents, tasks, events = _agents(mission, known), _tasks(mission), _events(mission)
    deadlines = np.flatnonzero(np.isfinite(mission.deadline))
    agenda = _agenda(mission, deadlines, known, slots)
    reports = 2 * (rows + slots) * n + 2 * n + 1024 if known is Knowledge.LOCAL else n
    head = _head(mission, known, len(events) + len(deadlines) + (known is Knowledge.LOCAL))
    parts = {
        "head": head,
        "agents": agents,
        "tasks": tasks,
        "events": events,
        "agenda": agenda,
        "reports": np.zeros(reports, record_type(layout.Report)),
        "renumbered": np.zeros(reports, np.int32),
        "allowed": _allowed(mission),
        "area": np.array(mission.area),
        "sites": np.ascontiguousarray(instance.task_position.T),
        "places": np.ascontiguousarray(instance.start_position.T),
        "visible": np.zeros(n, np.bool_),
        "now": np.zeros(m),
        "looks": np.zeros(n, np.bool_),
        "speaks": np.zeros(n, np.bool_),
        "numbers": np.zeros(n, np.int32),
        "task_hour": np.full((rows, wide_m), -1.0),
        "task_left": np.zeros((rows, wide_m)),
        "agent_hour": np.full((rows, wide_n), -1.0),
        "agent_report": np.full((rows, wide_n), NOBODY, np.int32),
        "sent_task_hour": np.full((slots, n, wide_m), -1.0),
        "sent_task_left": np.zeros((slots, n, wide_m)),
        "sent_agent_hour": np.full((slots, n, wide_n), -1.0),
        "sent_agent_report": np.full((slots, n, wide_n), NOBODY, np.int32),
        "heard": np.zeros((slots, n, n), np.bool_),
        "link_number": np.full((n, n) if mission.radio.burst else (0, 0), -1),
        "link_bad": np.zeros((n, n) if mission.radio.burst else (0, 0), np.intp),
        "silences": np.zeros(len(events), np.intp),
        "deciding": np.zeros(n, np.intp),
        "changed_agents": np.zeros(n, np.intp),
        "changed_tasks": np.zeros(m, np.intp),
    }
    return MissionArrays(**{name: _by_attribute(part) for name, part in parts.items()})  # type: ignore[arg-type]


def _on_the_air(radio: Radio) -> int:
    """Return how many messages of an agent are on the air at once at the most."""
    return 1 if radio.delay == 0 else int(radio.delay // radio.period) + 2


def begun(packed: MissionArrays, seed: int = 0) -> MissionArrays:
    """Return a copy of a packed mission for one run.

    Parameters
    ----------
    packed : MissionArrays
    seed : int
        Of the radio's chances, beside that of the mission.
    """
    state = MissionArrays(*(cast(FloatArray, part).copy() for part in packed))  # type: ignore[arg-type]
    head = state.head[0]
    head.loss_key, head.burst_key = keyed(head.loss_key, seed), keyed(head.burst_key, seed)
    return state


def records(part: object) -> Records:
    """Return records of `MissionArrays` as the array that they are, with columns by name."""
    return cast(Records, part)


def _by_attribute(part: Records | FloatArray) -> Records | FloatArray:
    """Return an array; one of records with its fields as attributes."""
    return part if part.dtype.names is None else part.view(np.recarray)


def _head(mission: Mission, knowledge: Knowledge, entries: int) -> Records:
    radio, pace, burst = mission.radio, mission.pace, mission.radio.burst
    head = np.zeros(1, record_type(layout.Head))
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
    agents = np.zeros(instance.n, record_type(layout.Agent))
    agents["ability"], agents["speed"], agents["returns"] = instance.ability, instance.speed, instance.returns
    agents["energy_per_distance"] = instance.agent_energy_per_distance
    agents["range"] = instance.communication_range
    has_base = instance.return_base >= 0
    for axis, name in enumerate("xyz"):
        agents[name] = agents[f"home_{name}"] = instance.start_position[:, axis]
        agents[f"home_{name}"][has_base] = instance.bases.position[instance.return_base[has_base], axis]
    agents["battery"] = agents["capacity"] = instance.battery
    for name in ("task", "previous", "next", "order_task", "report"):
        agents[name] = NOBODY
    agents["speaks"] = 1
    agents["known"] = np.arange(instance.n) if knowledge is Knowledge.LOCAL else 0
    return agents


def _tasks(mission: Mission) -> Records:
    instance = mission.instance
    tasks = np.zeros(instance.m, record_type(layout.Task))
    tasks["workload"], tasks["priority"] = instance.workload, instance.priority
    for axis, name in enumerate("xyz"):
        tasks[name] = instance.task_position[:, axis]
    for name in ("appears", "deadline", "growth"):
        tasks[name] = getattr(mission, name)
    tasks["first"] = tasks["last"] = NOBODY
    tasks["closed"] = np.inf
    return tasks


def _events(mission: Mission) -> Records:
    events = np.zeros(len(mission.timeline), record_type(layout.Happening))
    kinds = list(EventKind)
    for row, event in zip(events, mission.timeline, strict=True):
        row["hour"], row["kind"] = event.hour, kinds.index(event.kind)
        row["agent"] = NOBODY if event.agent is None else mission.instance.agent_index[event.agent]
        row["task"] = NOBODY if event.task is None else mission.instance.task_index[event.task]
        row["amount"] = _amount(event)
        if event.until is not None:
            row["until"] = event.until
        if event.center is not None and event.radius is not None:
            row["x"], row["y"], row["z"] = event.center
            row["radius"] = event.radius
    return events


def _amount(event: Event) -> float:
    """Return by how much an agent is recharged, or the work left of a task."""
    return event.amount or event.workload or 0.0


def _agenda(mission: Mission, deadlines: NDArray[np.intp], knowledge: Knowledge, slots: int) -> Records:
    """Return the agenda at hour 0: all that happens, deadlines, and the first messages."""
    rows = [(event.hour, int(Turn.EVENT), number) for number, event in enumerate(mission.timeline)]
    rows += [(float(mission.deadline[task]), int(Turn.DEADLINE), task) for task in deadlines.tolist()]
    if knowledge is Knowledge.LOCAL:
        rows.append((0.0, int(Turn.RADIO), 0))
    least = len(rows) + slots + mission.instance.n + mission.instance.m
    agenda = np.zeros(2 * least + 64, record_type(layout.Entry))
    ordered = sorted((hour, turn, count, item) for count, (hour, turn, item) in enumerate(rows, 1))
    for row, (hour, turn, count, item) in zip(agenda, ordered, strict=False):
        row["hour"], row["turn"], row["count"], row["subject"] = hour, turn, count, item
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
    """Return the measures of a compiled mission that is over; seconds and decisions are not measured.

    Parameters
    ----------
    mission : Mission
        As it was packed.
    state : MissionArrays
    policy : str
        Its name.
    seed : int
        Of the run.
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
