"""Consistency checks of inputs with the planner's state, which they do not modify."""

from alloc.allocators.online.planner.inputs import Report
from alloc.allocators.online.planner.state import LiveState
from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.missions.events import BEFORE, Event
from alloc.problems.missions.simulation.state import AgentStatus, TaskStatus

STANDING = {AgentStatus.ABSENT: "absent", AgentStatus.AWAY: "away", AgentStatus.FAILED: "failed"}


def check_hour(state: LiveState, hour: float) -> None:
    """Raise `InputError` for an hour in the past, or after the end of the mission."""
    if hour < state.hour:
        raise InputError(f"is {hour:g}, but it is already hour {state.hour:g}; events come in order", "hour")
    if hour > state.mission.horizon:
        raise InputError(f"is {hour:g}, after the mission ends at {state.mission.horizon:g}", "hour")


def check_event(state: LiveState, event: Event) -> None:
    """Raise `InputError` if an event cannot happen in the present state.

    A task that the planner assumes to be done may have work left, so the same events as for open tasks are accepted.
    """
    agent = None if event.agent is None else state.agent(event.agent)
    task = None if event.task is None else state.task(event.task)
    if event.kind not in BEFORE:
        return
    if agent is not None:
        was = STANDING.get(agent.status, "in the mission")
    else:
        assert task is not None
        was = "there" if task.status in (TaskStatus.OPEN, TaskStatus.DONE) else str(task.status)
    allowed, _ = BEFORE[event.kind]
    if was not in allowed:
        kind, name = ("task", event.task) if agent is None else ("agent", event.agent)
        must = " or ".join(sorted(allowed))
        raise InputError(f"{event.kind!s} needs {kind} {shown(name)} to be {must}, but it is {was}", "event")


def check_report(state: LiveState, report: Report) -> None:
    """Raise `InputError` if an agent cannot report at all, or not this."""
    agent = state.agent(report.agent)
    if agent.status in (AgentStatus.ABSENT, AgentStatus.FAILED):
        raise InputError(f"agent {shown(report.agent)} is {agent.status}, and cannot report", "agent")
    if report.task is not None:
        state.task(report.task)
    if report.position is not None and state.distances.has_table:
        raise InputError("has no distances, as these are given by a table; say at which task it is", "position")
