"""Logs of simulations, and their replay."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version

from alloc.problems.errors import InputError
from alloc.problems.missions.files.document import mission_from_document, mission_to_document
from alloc.problems.missions.files.log_file import LOG_FORMAT, MissionLog, Record
from alloc.problems.missions.simulation.agenda import Wanted
from alloc.problems.missions.simulation.measures import DecisionTimes, MissionResult, measured
from alloc.problems.missions.simulation.simulation import Simulation
from alloc.problems.missions.simulation.state import Order


def log_of(simulation: Simulation, result: MissionResult) -> MissionLog:
    """Return the log of a finished simulation.

    Parameters
    ----------
    simulation : Simulation
    result : MissionResult
    """
    header: Record = {
        "format": LOG_FORMAT,
        "mission": mission_to_document(simulation.mission),
        "policy": result.policy,
        "knowledge": result.knowledge,
        "seed": result.seed,
        "version": _version(),
    }
    return MissionLog(header, tuple(simulation.log.records), result.to_dict())


def _version() -> str:
    try:
        return version("alloc-mrta")
    except PackageNotFoundError:  # run from a checkout without installation
        return "unknown"


@dataclass(frozen=True)
class Laws:
    """Conservation laws of work and energy, as found in a replay: the two sides of each.

    Attributes
    ----------
    work_appeared : float
        Work that appeared or grew.
    work_done, work_left, work_cancelled, work_missed : float
        What became of that work; the four add up to `work_appeared`.
    energy : float
        Energy of all flights.
    battery_lost, battery_energy : float
        Energy that batteries lost, and energy of the flights of agents with a battery; the two are equal.
    """

    work_appeared: float
    work_done: float
    work_left: float
    work_cancelled: float
    work_missed: float
    energy: float
    battery_lost: float
    battery_energy: float


def replay(log: MissionLog, observe: Callable[[Simulation], None] | None = None) -> tuple[MissionResult, Laws]:
    """Simulate a mission again with the orders and messages of its log, and check all conservation laws.

    Parameters
    ----------
    log : MissionLog
    observe : callable, optional
        Called with the simulation before it begins, e.g. a `Recorder`.

    Returns
    -------
    result : MissionResult
        The same as in the log, from which times in seconds are taken.
    laws : Laws

    Raises
    ------
    InputError
        If the log contradicts the replay of its orders; the error's ``place`` is the line.
    ConservationError
        If a conservation law is violated.
    """
    header, result = log.header, log.result
    mission = mission_from_document(header["mission"])
    seed = _whole(header["seed"], "line 1: seed")
    simulation = Simulation(mission, str(header["knowledge"]), seed, aware=False)
    if observe is not None:
        observe(simulation)
    while (request := simulation.advance()) is not None:
        _follow(simulation, request.wanted, log.records)
    times = _times(result, len(log.records) + 2)
    found = measured(simulation, str(header["policy"]), seed, times)
    _require_same(MissionLog(header, log.records, result), log_of(simulation, found), str(header["version"]))
    return found, _laws(simulation)


def _follow(simulation: Simulation, wanted: Wanted, records: tuple[Record, ...]) -> None:
    """Send the messages or give the orders that come next in the log."""
    kinds = ("message",) if wanted is Wanted.MESSAGES else ("order", "refused")
    while (number := len(simulation.log.records)) < len(records) and records[number].get("record") in kinds:
        record, line = records[number], number + 2
        if record.get("hour") != simulation.state.hour:
            return
        agent = record.get("agent")
        if agent not in simulation.mission.instance.agent_index:
            raise InputError("names an agent that the mission does not have", f"line {line}")
        if wanted is Wanted.MESSAGES:
            simulation.send(str(agent), _whole(record.get("bytes"), f"line {line}"))
            continue
        order = _order(record, simulation, line)
        if record["record"] == "refused":
            simulation.refuse(str(agent), order, str(record.get("reason")))
        else:
            simulation.order(str(agent), order, trusted=True)
        if len(simulation.log.records) == number:
            raise InputError("orders what the agent already does", f"line {line}")


def _order(record: Record, simulation: Simulation, line: int) -> Order:
    task, position = record.get("task"), record.get("position")
    if task is not None and record["record"] == "order" and task not in simulation.mission.instance.task_index:
        raise InputError("names a task that the mission does not have", f"line {line}")
    if position is None:
        return Order(None if task is None else str(task))
    if not isinstance(position, list) or len(position) != 3 or not all(isinstance(x, int | float) for x in position):
        raise InputError("must have a position of three numbers", f"line {line}")
    x, y, z = position
    return Order(position=(x, y, z))


def _require_same(log: MissionLog, again: MissionLog, made_by: str) -> None:
    """Raise `InputError` for the first line in which a log differs from its replay."""
    header = {**again.header, "version": made_by}
    for line, (one, other) in enumerate(zip((log.header, *log.records), (header, *again.records), strict=False), 1):
        if one != other:
            raise InputError(f"does not follow from the orders before it: {_difference(one, other)}", f"line {line}")
    if len(log.records) != len(again.records):
        message = f"has {len(log.records)} records, but the mission has {len(again.records)}"
        raise InputError(message, f"line {len(log.records) + 2}")
    if log.result != again.result:
        line = len(log.records) + 2
        raise InputError(f"is not the result: {_difference(log.result, again.result)}", f"line {line}")


def _difference(one: Record, other: Record) -> str:
    name = next((key for key in other if one.get(key) != other[key]), None)
    if name is None:
        return f"it has {', '.join(key for key in one if key not in other)} too many"
    return f"its {name} is {one.get(name)!r}, not {other[name]!r}"


def _times(result: Record, line: int) -> DecisionTimes:
    def figure(name: str) -> float | None:
        value = result.get(name)
        if value is None or (isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)):
            return value
        raise InputError(f"must have a number as {name}", f"line {line}")

    return DecisionTimes(
        count=_whole(result.get("decisions"), f"line {line}"),
        late=_whole(result.get("decisions_late"), f"line {line}"),
        mean_ms=figure("decision_ms_mean"),
        p99_ms=figure("decision_ms_p99"),
        worst_ms=figure("decision_ms_worst"),
        runtime_s=figure("runtime_s") or 0.0,
    )


def _whole(value: object, place: str) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and value >= 0:
        return value
    raise InputError(f"must be a whole number, got {value!r}", place)


def _laws(simulation: Simulation) -> Laws:
    tasks, agents = simulation.state.tasks, simulation.state.agents
    powered = [agent for agent in agents if agent.capacity < math.inf]

    return Laws(
        work_appeared=math.fsum(task.appeared + task.grown for task in tasks),
        work_done=math.fsum(task.done for task in tasks),
        work_left=math.fsum(task.left for task in tasks),
        work_cancelled=math.fsum(task.cancelled for task in tasks),
        work_missed=math.fsum(task.missed for task in tasks),
        energy=math.fsum(agent.energy for agent in agents),
        battery_lost=math.fsum(agent.capacity - agent.battery for agent in powered),
        battery_energy=math.fsum(agent.energy for agent in powered),
    )
