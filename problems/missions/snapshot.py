"""Snapshot of a mission at an hour as an instance, to which allocators can be applied."""

import math

import numpy as np

from alloc.problems.distances.given import DistanceTable
from alloc.problems.instance import Instance
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.awareness import FullAwareness
from alloc.problems.missions.simulation.changes import happen
from alloc.problems.missions.simulation.motion import close
from alloc.problems.missions.simulation.reports import AgentReport, TaskReport, View
from alloc.problems.missions.simulation.state import ACTIVE, MissionState, TaskStatus
from alloc.problems.units import Units
from alloc.problems.vocabulary import GEOGRAPHIC


def snapshot(view: View, name: str = "snapshot") -> Instance | None:
    """Return the agents in the mission at their present places and the open tasks with the work left, as known.

    Flights home of agents that return limit the tasks that they can reach, but do not count as energy.

    Parameters
    ----------
    view : View
    name : str

    Returns
    -------
    Instance or None
        None if no agent is in the mission or no task is open.
    """
    agents = [report for report in view.agents.values() if report.status in ACTIVE]
    tasks = [report for report in view.tasks.values() if report.status is TaskStatus.OPEN]
    if not agents or not tasks:
        return None
    unit = view.distance_unit if view.metric == GEOGRAPHIC else ""
    return Instance(
        name=name,
        agent_ids=[report.facts.id for report in agents],
        task_ids=[report.facts.id for report in tasks],
        ability=[report.facts.ability for report in agents],
        workload=[_whole(report.left) for report in tasks],
        agent_position=_positions(agents),
        task_position=np.array([report.facts.place.position or (np.nan,) * 3 for report in tasks]),
        battery=[max(0.0, report.battery) for report in agents],
        communication_range=[report.facts.range for report in agents],
        speed=[report.facts.speed for report in agents],
        priority=[report.facts.priority for report in tasks],
        allowed_tasks=_allowed(view, agents, tasks),
        skills=[sorted(report.facts.skills) for report in agents],
        needs=[sorted(report.facts.needs) for report in tasks],
        agent_energy_per_distance=[report.facts.energy_per_distance for report in agents],
        energy_per_distance=max(report.facts.energy_per_distance for report in agents),
        metric=view.metric,
        distances=_table(view, agents, tasks) if view.has_table else None,
        units=Units(distance=unit),
    )


def snapshot_at(mission: Mission, hour: float) -> Instance | None:
    """Return the snapshot of a mission at an hour, without any orders up to then.

    Parameters
    ----------
    mission : Mission
    hour : float

    Returns
    -------
    Instance or None
        None if no agent is in the mission or no task is open.
    """
    state = MissionState(mission)
    for event in mission.timeline:
        if event.hour > hour:
            break
        state.hour = event.hour
        happen(state, event)
    state.hour = hour
    for task in state.tasks:
        if task.status is TaskStatus.OPEN and task.facts.deadline <= hour:
            close(state, task, TaskStatus.MISSED)
    awareness = FullAwareness(state)
    awareness.refresh()
    return snapshot(awareness.view(None), mission.name)


def _whole(left: float) -> float:
    """Return a valid workload: tiny values are rounded to 0."""
    return left if left >= 1e-60 else 0.0


def _positions(agents: list[AgentReport]) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.array([report.place.position or (np.nan,) * 3 for report in agents])


def _allowed(view: View, agents: list[AgentReport], tasks: list[TaskReport]) -> list[list[int] | None]:
    """Return the tasks that each agent may do: those on its list from which it can return home."""
    allowed: list[list[int] | None] = []
    for report in agents:
        names = report.facts.tasks
        if report.facts.returns:
            allowed.append([j for j, task in enumerate(tasks) if view.refusal(report, task) is None])
        else:
            allowed.append(None if names is None else [j for j, task in enumerate(tasks) if task.facts.id in names])
    return allowed


def _table(view: View, agents: list[AgentReport], tasks: list[TaskReport]) -> DistanceTable:
    """Return all distances from the agents' present places; pairs without a path are left out."""
    rows = [
        (agent.facts.id, task.facts.id, distance)
        for agent in agents
        for task in tasks
        if (distance := view.distance(agent, task)) < math.inf
    ]
    names = [agent.facts.id for agent in agents], [task.facts.id for task in tasks]
    return DistanceTable.of(rows, *names, missing="unreachable")
