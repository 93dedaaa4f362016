"""A plan as rows per agent and task: the figures that text, spreadsheets, maps and data frames show."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from itertools import starmap
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from alloc.problems import IDLE, Instance
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.text import heading
from alloc.problems.units import labels

if TYPE_CHECKING:
    from alloc.allocators.result import Result

START = "start"
"""Value of `AgentRow.returns_to` for an agent that returns to its start."""

Value = str | float | tuple[str, ...] | None


@dataclass(frozen=True)
class AgentRow:
    """What one agent does.

    Attributes
    ----------
    agent : str
    task : str or None
        None for an idle agent.
    ability : float
    arrival : float or None
        Arrival time at its task; None for an idle agent, and for one that cannot take its task.
    completion_time : float or None
        Completion time of its task; None in the same cases.
    returns_to : str or None
        Id of its base, or ``start`` if it returns to its start; None if it does not return.
    distance, energy : float
        Distance of its flight, including the return if any, and the energy for it; 0 if `arrival` is None.
    battery, battery_left : float or None
        Energy available at the start and left at the end; None if unlimited.
    violation : str
        Why the agent cannot take its task; empty if it can.
    """

    agent: str
    task: str | None
    ability: float
    arrival: float | None
    completion_time: float | None
    returns_to: str | None
    distance: float
    energy: float
    battery: float | None
    battery_left: float | None
    violation: str


@dataclass(frozen=True)
class TaskRow:
    """How one task is done.

    Attributes
    ----------
    task : str
    workload, priority : float
    completion_time : float or None
        None if the task is unserved.
    ability : float
        Sum over the group.
    agents : tuple of str
        The group.
    """

    task: str
    workload: float
    priority: float
    completion_time: float | None
    ability: float
    agents: tuple[str, ...]


Row = TypeVar("Row", AgentRow, TaskRow)


@dataclass(frozen=True)
class Column(Generic[Row]):
    """A column of a table for people: its heading, with the unit, and a function that gives its value in a row."""

    heading: str
    value: Callable[[Row], Value]


def agent_rows(result: "Result", agents: IntArray | None = None) -> list[AgentRow]:
    """Return a row for each agent, or for each of `agents`; empty without an allocation.

    Parameters
    ----------
    result : Result
    agents : ndarray of int, optional
        Indices.
    """
    if result.allocation is None or result.evaluation is None:
        return []
    instance = result.instance
    chosen = np.arange(instance.n) if agents is None else agents
    reasons = {violation.agent: violation.reason for violation in result.evaluation.violations}
    task = result.allocation.task_of_agent[chosen]
    goes = (task != IDLE) & ~np.isin(chosen, np.fromiter(reasons, dtype=np.intp, count=len(reasons)))
    arrival, done = np.full((2, len(chosen)), np.nan)
    distance, energy = np.zeros((2, len(chosen)))
    arrival[goes], distance[goes], energy[goes] = _flights(instance, chosen[goes], task[goes])
    done[goes] = result.evaluation.completion_time[task[goes]]
    battery = instance.battery[chosen]
    with np.errstate(invalid="ignore"):
        left = np.maximum(battery - energy, 0.0)
    ids: list[str | None] = [*instance.task_ids, None]
    before, after = map(_known, (arrival, done)), map(_known, (distance, energy, battery, left))
    homes = [_returns_to(instance, i) for i in chosen.tolist()]
    violations = [reasons.get(i, "") for i in chosen.tolist()]
    columns = (instance.ability[chosen].tolist(), *before, homes, *after, violations)
    names = [instance.agent_ids[i] for i in chosen.tolist()], [ids[j] for j in task.tolist()]
    return list(starmap(AgentRow, zip(*names, *columns, strict=True)))


def _returns_to(instance: Instance, agent: int) -> str | None:
    base = instance.return_base[agent]
    return instance.bases.ids[base] if base >= 0 else START if instance.returns[agent] else None


def _flights(instance: Instance, agents: IntArray, tasks: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return each agent's arrival time at the task of the same index, and distance and energy of its whole flight."""
    reach, most = instance.reach, sys.float_info.max
    origin, away = reach.origin[agents], reach.distance_of(agents, tasks)
    with np.errstate(over="ignore"):
        arrival = np.minimum(away / instance.speed[agents], most)
        energy = np.minimum(reach.flown(origin, tasks, away) * reach.energy_per_distance, most)
        return arrival, np.minimum(reach.trips(origin, tasks, away), most), energy


def task_rows(result: "Result", tasks: IntArray | None = None) -> list[TaskRow]:
    """Return a row for each task, or for each of `tasks`; empty without an allocation.

    Parameters
    ----------
    result : Result
    tasks : ndarray of int, optional
        Indices.
    """
    if result.allocation is None or result.evaluation is None:
        return []
    instance, score = result.instance, result.evaluation
    task = result.allocation.task_of_agent.copy()
    task[[violation.agent for violation in score.violations]] = IDLE
    order = np.argsort(task, kind="stable")
    first = np.searchsorted(task[order], np.arange(instance.m + 1))
    unserved = set(score.unserved_tasks)
    chosen = range(instance.m) if tasks is None else tasks.tolist()
    return [
        TaskRow(
            task=instance.task_ids[j],
            workload=float(instance.workload[j]),
            priority=float(instance.priority[j]),
            completion_time=None if j in unserved else float(score.completion_time[j]),
            ability=float(score.group_ability[j]),
            agents=tuple(instance.agent_ids[i] for i in order[first[j] : first[j + 1]].tolist()),
        )
        for j in chosen
    ]


def agent_columns(instance: Instance) -> list[Column[AgentRow]]:
    """Return the columns of the table of agents, without those that are uninformative for this instance."""
    units = labels(instance)
    columns: list[Column[AgentRow]] = [
        Column("agent", lambda row: row.agent),
        Column("task", lambda row: row.task),
    ]
    if instance.has_travel_time:
        columns.append(Column(heading("arrival", units.time), lambda row: row.arrival))
    columns.append(Column(heading("finish", units.time), lambda row: row.completion_time))
    if (instance.return_base >= 0).any():
        columns.append(Column("returns to", lambda row: row.returns_to))
    if instance.distances is not None or not np.isnan(instance.task_position).all():
        columns.append(Column(heading("distance", units.distance), lambda row: row.distance))
        columns.append(Column(heading("energy", units.energy), lambda row: row.energy))
    if np.isfinite(instance.battery).any():
        columns.append(Column(heading("battery left", units.energy), lambda row: row.battery_left))
    return columns


def task_columns(instance: Instance) -> list[Column[TaskRow]]:
    """Return the columns of the table of tasks, without those that are uninformative for this instance."""
    units = labels(instance)
    columns: list[Column[TaskRow]] = [
        Column("task", lambda row: row.task),
        Column(heading("workload", units.work), lambda row: row.workload),
    ]
    if len(set(instance.priority.tolist())) > 1:
        columns.append(Column("priority", lambda row: row.priority))
    return [
        *columns,
        Column(heading("finish", units.time), _finish),
        Column("agents", lambda row: float(len(row.agents))),
        Column("group", lambda row: row.agents),
    ]


def _finish(row: TaskRow) -> Value:
    return "unserved" if row.completion_time is None else row.completion_time


def _known(values: FloatArray) -> list[float | None]:
    """Return the values, with None in place of those that are not finite."""
    return [value if np.isfinite(value) else None for value in values.tolist()]
