"""What agents see and hear, compiled: see `alloc.problems.missions.simulation.awareness`."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.layout import (
    ABSENT,
    IDLE,
    NOBODY,
    OPEN,
    TO_COME,
    TO_TASK,
    WORKING,
    Agent,
    Head,
    MissionArrays,
    Report,
    Task,
)
from alloc.allocators.missions.motion import battery_of, place_of, work_left
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.fields import BoolArray, FloatArray

Numbers = NDArray[np.int32]

INVISIBLE = -9.0
"""What is seen of a task that is to come."""


@compiled_in_place
def look_around(state: MissionArrays) -> None:
    """Let all agents that are to look around see all tasks and all agents in the mission within the sensing radius."""
    head, agents = state.head[0], state.agents
    if head.reports + len(agents) > len(state.reports):
        drop_unknown(state)
    for number in range(len(agents)):
        agent = agents[number]
        state.visible[number] = IDLE <= agent.status <= WORKING
        if state.visible[number]:
            agent.report = head.reports
            write_report(head, agent, state.reports[head.reports])
            head.reports += 1
    locate(head, agents, state.places, state.numbers)
    for number in range(len(state.tasks)):
        state.now[number] = seen_of(head, agents, state.tasks[number], number)
    see_tasks(head, state.looks, state.places, state.sites, state.now, state.task_hour, state.task_left)
    seen = state.visible, state.numbers, state.agent_hour, state.agent_report
    see_agents(head, state.looks, state.places, seen[0], seen[1], seen[2], seen[3])
    state.looks[:] = False


@compiled_in_place
def locate(head: Head, agents: Sequence[Agent], places: FloatArray, reports: Numbers) -> None:
    """Fill in where all agents are, and their last reports."""
    for number in range(len(agents)):
        places[0, number], places[1, number], places[2, number] = place_of(agents[number], head.hour)
        reports[number] = agents[number].report


@compiled_in_place
def seen_of(head: Head, agents: Sequence[Agent], task: Task, number: int) -> float:
    """Return the work left of a task, minus its status where it is closed."""
    if task.status == OPEN:
        return work_left(head, agents, task, number)
    return INVISIBLE if task.status == TO_COME else -float(task.status)


@inlined
def length(is_manhattan: int, dx: float, dy: float, dz: float) -> float:
    """Return the length of a way, NaN where an end is unknown."""
    return abs(dx) + abs(dy) + abs(dz) if is_manhattan else math.sqrt(dx * dx + dy * dy + dz * dz)


@compiled_in_place
def see_tasks(
    head: Head,
    looks: BoolArray,
    places: FloatArray,
    sites: FloatArray,
    now: FloatArray,
    task_hour: FloatArray,
    task_left: FloatArray,
) -> None:
    """Take notice of the tasks that agents see."""
    at_x, at_y, at_z = sites[0], sites[1], sites[2]
    sensing, hour, is_manhattan = head.sensing + TOLERANCE, head.hour, head.is_manhattan
    for number in range(len(looks)):
        if looks[number]:
            x, y, z = places[0, number], places[1, number], places[2, number]
            for task in range(len(now)):
                is_far = length(is_manhattan, at_x[task] - x, at_y[task] - y, at_z[task] - z) > sensing
                if not is_far and now[task] != INVISIBLE:
                    task_hour[number, task] = hour
                    task_left[number, task] = now[task]


@compiled_in_place
def see_agents(
    head: Head,
    looks: BoolArray,
    places: FloatArray,
    visible: BoolArray,
    reports: Numbers,
    agent_hour: FloatArray,
    agent_report: Numbers,
) -> None:
    """Take notice of the agents that agents see."""
    at_x, at_y, at_z = places[0], places[1], places[2]
    sensing, hour, is_manhattan = head.sensing + TOLERANCE, head.hour, head.is_manhattan
    for number in range(len(looks)):
        if looks[number]:
            x, y, z = at_x[number], at_y[number], at_z[number]
            for other in range(len(visible)):
                is_far = length(is_manhattan, at_x[other] - x, at_y[other] - y, at_z[other] - z) > sensing
                if not is_far and visible[other]:
                    agent_hour[number, other] = hour
                    agent_report[number, other] = reports[other]


@compiled_in_place
def write_report(head: Head, agent: Agent, report: Report) -> None:
    """Write a report of an agent."""
    report.x, report.y, report.z = place_of(agent, head.hour)
    report.status, report.battery = agent.status, battery_of(agent, head.hour)
    report.task = agent.order_task if agent.order == TO_TASK else NOBODY


@compiled_in_place
def drop_unknown(state: MissionArrays) -> None:
    """Make room where no more reports can be kept: drop those that nobody knows any more."""
    head = state.head[0]
    number = state.renumbered
    number[:] = NOBODY
    for known in state.agent_report.flat:
        if known != NOBODY:
            number[known] = 0
    for known in state.sent_agent_report.flat:
        if known != NOBODY:
            number[known] = 0
    kept = 0
    for place in range(len(number)):
        if number[place] != NOBODY:
            number[place] = kept
            if kept != place:
                one, other = state.reports[kept], state.reports[place]
                one.status, one.x, one.y, one.z = other.status, other.x, other.y, other.z
                one.battery, one.task = other.battery, other.task
            kept += 1
    if kept + len(state.agents) > len(number):
        raise OverflowError("a compiled mission has no room for what agents know")
    head.reports = kept
    renumber(state.agent_report.reshape(-1), number)
    renumber(state.sent_agent_report.reshape(-1), number)


@compiled_in_place
def renumber(known: Numbers, number: Numbers) -> None:
    """Replace numbers of reports by new ones."""
    for place in range(len(known)):
        if known[place] != NOBODY:
            known[place] = number[known[place]]


@compiled_in_place
def refresh(state: MissionArrays) -> None:
    """Let all know all that is so now."""
    head = state.head[0]
    for number in range(len(state.agents)):
        if state.agents[number].status != ABSENT:
            tell_all(state, number)
    for number in range(len(state.tasks)):
        if state.tasks[number].status != TO_COME:
            state.task_hour[0, number] = head.hour
            state.task_left[0, number] = seen_of(head, state.agents, state.tasks[number], number)


@compiled_in_place
def tell_all(state: MissionArrays, number: int) -> None:
    """Let all know what is so of an agent now."""
    write_report(state.head[0], state.agents[number], state.reports[number])
    state.agent_hour[0, number] = state.head[0].hour
    state.agent_report[0, number] = number
