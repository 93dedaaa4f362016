"""States of agents and tasks over time, with their names and colours in all plots of missions."""

import numpy as np

from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.missions.course import Course, Leg
from alloc.problems.missions.simulation.state import AgentStatus, TaskStatus

WAITING, IN_PROGRESS, DONE, MISSED, CANCELLED = "waiting", "in progress", "done", "missed", "cancelled"

TASK_COLOURS = {
    DONE: "#009e73",
    IN_PROGRESS: "#e69f00",
    WAITING: "#cc79a7",
    MISSED: "#d55e00",
    CANCELLED: "#999999",
}
"""From the palette of Okabe and Ito."""

WORKING, FLYING, REPOSITIONING, IDLE, AWAY = "working", "flying to a task", "flying to a position", "idle", "away"

AGENT_COLOURS = {
    WORKING: "#e69f00",
    FLYING: "#0072b2",
    REPOSITIONING: "#9fcdec",
    IDLE: "#e4e6e8",
    AWAY: "#8c8c8c",
}

_OVER = {TaskStatus.DONE: DONE, TaskStatus.MISSED: MISSED, TaskStatus.CANCELLED: CANCELLED}


def doing(leg: Leg) -> str | None:
    """Return the name of an agent's state; None if it is not in the mission."""
    if leg.status is AgentStatus.FLYING:
        return FLYING if leg.task >= 0 else REPOSITIONING
    return {AgentStatus.WORKING: WORKING, AgentStatus.IDLE: IDLE, AgentStatus.AWAY: AWAY}.get(leg.status)


def workers(course: Course, hours: FloatArray) -> IntArray:
    """Return how many agents work on each task at the given ascending hours, shape (m, hours)."""
    change = np.zeros((len(course.levels), len(hours) + 1), dtype=np.intp)
    for legs in course.legs:
        for leg in legs:
            if leg.status is AgentStatus.WORKING:
                begin, end = np.searchsorted(hours, [leg.begin, leg.end])
                change[leg.task, begin] += 1
                change[leg.task, end] -= 1
    count: IntArray = change[:, :-1].cumsum(axis=1)
    return count


def task_states(course: Course, hours: FloatArray) -> list[list[str | None]]:
    """Return the state of each task at the given ascending hours; None before the task appears."""
    count = workers(course, hours)
    return [
        [_state(status, int(here)) for status, here in zip(statuses, row, strict=True)]
        for statuses, row in zip(course.statuses(hours), count, strict=True)
    ]


def _state(status: TaskStatus, here: int) -> str | None:
    if status is TaskStatus.OPEN:
        return IN_PROGRESS if here else WAITING
    return _OVER.get(status)
