"""Conservation laws and consistency checks of a simulation."""

import math
from collections.abc import Iterator

from alloc.problems.errors import AllocError
from alloc.problems.missions.simulation.motion import work_left
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    AgentState,
    AgentStatus,
    MissionState,
    TaskState,
    TaskStatus,
)

TOLERANCE = 1e-9
"""Relative tolerance of a ledger."""


class ConservationError(AllocError):
    """A simulation violated a conservation law: a defect of the program, or a manipulated log."""


def check(state: MissionState, agents: list[AgentState] | None = None, tasks: list[TaskState] | None = None) -> None:
    """Raise `ConservationError` if a law is violated.

    Parameters
    ----------
    state : MissionState
    agents, tasks : list, optional
        Agents and tasks to check, e.g. those that have changed; all by default.
    """
    for broken in violations(
        state, state.agents if agents is None else agents, state.tasks if tasks is None else tasks
    ):
        raise ConservationError(f"at hour {state.hour:.17g} {broken}")


def violations(state: MissionState, agents: list[AgentState], tasks: list[TaskState]) -> Iterator[str]:
    """Yield descriptions of inconsistent ledgers, states and places of some agents and tasks."""
    for agent in agents:
        yield from _of_agent(agent)
    for task in tasks:
        yield from _of_task(state, task)


def _of_agent(agent: AgentState) -> Iterator[str]:
    name, facts = agent.facts.id, agent.facts
    flown = facts.energy_per_distance * agent.distance
    if agent.capacity < math.inf:
        lost = agent.capacity - agent.battery
        if not _is_close(lost, agent.energy, agent.capacity):
            yield f"the battery of {name!r} lost {lost!r}, but its flights took {agent.energy!r}"
        if agent.battery < -TOLERANCE * max(1.0, agent.capacity):
            yield f"the battery of {name!r} is {agent.battery!r}"
    if not _is_close(flown, agent.energy, flown):
        yield f"{name!r} flew {agent.distance!r}, but that took {agent.energy!r}"
    if (agent.flight is not None) != (agent.status is AgentStatus.FLYING):
        yield f"{name!r} is {agent.status} and has {'a' if agent.flight else 'no'} flight"
    if (agent.task is not None) != (agent.status is AgentStatus.WORKING):
        yield f"{name!r} is {agent.status} and has {'a' if agent.task else 'no'} task"
    if agent.flight is not None and agent.flight.distance > facts.range + TOLERANCE * max(1.0, facts.range):
        yield f"{name!r} flies {agent.flight.distance!r}, beyond its range"
    if agent.task is not None and agent.task.workers.get(agent.index) is not agent:
        yield f"{name!r} works at {agent.task.facts.id!r}, which does not know it"


def _of_task(state: MissionState, task: TaskState) -> Iterator[str]:
    name = task.facts.id
    total = task.appeared + task.grown
    left = work_left(state, task)
    grown = left - task.left if task.status is TaskStatus.OPEN and not task.begun else 0.0
    worked = max(0.0, task.left - left)
    accounted = task.done + worked + left - grown + task.cancelled + task.missed
    if not _is_close(total, accounted, max(total, left)):
        yield f"{total!r} of work on {name!r} appeared or grew, but {accounted!r} is accounted for"
    if min(left, task.done, task.cancelled, task.missed, task.appeared, task.grown) < 0:
        yield f"a ledger of {name!r} is below 0"
    if task.workers and task.status is not TaskStatus.OPEN:
        yield f"an agent works at {name!r}, which is {task.status}"
    if task.workers and not task.facts.appears <= state.hour <= task.facts.deadline:
        yield f"an agent works at {name!r} before it appears or after its deadline"
    for agent in task.workers.values():
        node = state.mission.instance.n + task.index
        if agent.status not in ACTIVE or agent.task is not task or node not in agent.place.nodes:
            yield f"{agent.facts.id!r} works at {name!r} and is not there"


def _is_close(one: float, other: float, scale: float) -> bool:
    return abs(one - other) <= TOLERANCE * max(abs(one), abs(other), abs(scale))
