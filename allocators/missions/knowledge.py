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
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import BoolArray, FloatArray

INVISIBLE = -9.0
"""What is seen of a task that is to come."""


@compiled
def see_all(
    head: Head, agents: Sequence[Agent], tasks: Sequence[Task], places: FloatArray, visible: BoolArray, now: FloatArray
) -> None:
    """Fill in where all agents are, which are in the mission, and what is seen of all tasks."""
    for number in range(len(agents)):
        agent = agents[number]
        places[0, number], places[1, number], places[2, number] = place_of(agent, head.hour)
        visible[number] = IDLE <= agent.status <= WORKING
    for number in range(len(tasks)):
        now[number] = seen_of(head, agents, tasks[number], number)


@compiled
def seen_of(head: Head, agents: Sequence[Agent], task: Task, number: int) -> float:
    """Return the work left of a task, minus its status where it is closed."""
    if task.status == OPEN:
        return work_left(head, agents, task, number)
    return INVISIBLE if task.status == TO_COME else -float(task.status)


@compiled
def look_around(state: MissionArrays, number: int) -> None:
    """Let an agent see all tasks and all agents in the mission within its sensing radius."""
    head, agents = state.head[0], state.agents
    agents[number].looked = head.turn
    fill_distances(head, state.places, number, state.places, state.distance)
    for other in range(len(agents)):
        if other == number or (state.visible[other] and not state.distance[other] > head.sensing):
            if agents[other].reported != head.turn:
                report(state, other)
            state.agent_hour[number, other] = head.hour
            state.agent_report[number, other] = agents[other].report
    fill_distances(head, state.places, number, state.sites, state.distance)
    see_tasks(head, state.now, state.distance, state.task_hour[number], state.task_left[number])


@compiled
def see_tasks(head: Head, now: FloatArray, distance: FloatArray, hour: FloatArray, left: FloatArray) -> None:
    """Take notice of the tasks that an agent sees."""
    for task in range(len(now)):
        seen = now[task] != INVISIBLE and not distance[task] > head.sensing
        hour[task] = head.hour if seen else hour[task]
        left[task] = now[task] if seen else left[task]


@compiled
def fill_distances(head: Head, places: FloatArray, number: int, goals: FloatArray, distance: FloatArray) -> None:
    """Fill in how far places are from that of an agent; NaN where one is unknown."""
    x, y, z = places[0, number], places[1, number], places[2, number]
    is_manhattan = head.is_manhattan
    for goal in range(goals.shape[1]):
        dx, dy, dz = goals[0, goal] - x, goals[1, goal] - y, goals[2, goal] - z
        if is_manhattan:
            distance[goal] = abs(dx) + abs(dy) + abs(dz)
        else:
            distance[goal] = math.sqrt(dx * dx + dy * dy + dz * dz)


@compiled
def report(state: MissionArrays, number: int) -> None:
    """Report what is true of an agent now, once for all who see it in a turn."""
    head, agent = state.head[0], state.agents[number]
    if head.reports == len(state.reports):
        drop_unknown(state)
    agent.report, agent.reported = head.reports, head.turn
    write_report(head, agent, state.reports[head.reports])
    head.reports += 1


@compiled
def write_report(head: Head, agent: Agent, report: Report) -> None:
    """Write a report of an agent."""
    report.x, report.y, report.z = place_of(agent, head.hour)
    report.status, report.battery = agent.status, battery_of(agent, head.hour)
    report.task = agent.order_task if agent.order == TO_TASK else NOBODY


@compiled
def drop_unknown(state: MissionArrays) -> None:
    """Make room where no more reports can be kept: drop those that nobody knows any more."""
    head = state.head[0]
    number = np.full(len(state.reports), NOBODY, dtype=np.int32)
    for known in state.agent_report.flat:
        if known != NOBODY:
            number[known] = 0
    for known in state.sent_agent_report.flat:
        if known != NOBODY:
            number[known] = 0
    for agent in range(len(state.agents)):
        if state.agents[agent].reported == head.turn:
            number[state.agents[agent].report] = 0
    kept = 0
    for place in range(len(number)):
        if number[place] != NOBODY:
            number[place] = kept
            if kept != place:
                one, other = state.reports[kept], state.reports[place]
                one.status, one.x, one.y, one.z = other.status, other.x, other.y, other.z
                one.battery, one.task = other.battery, other.task
            kept += 1
    if kept == len(number):
        raise OverflowError("a compiled mission has no room for what agents know")
    head.reports = kept
    renumber(state.agent_report.reshape(-1), number)
    renumber(state.sent_agent_report.reshape(-1), number)
    for agent in range(len(state.agents)):
        if state.agents[agent].reported == head.turn:
            state.agents[agent].report = number[state.agents[agent].report]


@compiled
def renumber(known: NDArray[np.int32], number: NDArray[np.int32]) -> None:
    """Replace numbers of reports by new ones."""
    for place in range(len(known)):
        if known[place] != NOBODY:
            known[place] = number[known[place]]


@compiled
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


@compiled
def tell_all(state: MissionArrays, number: int) -> None:
    """Let all know what is so of an agent now."""
    write_report(state.head[0], state.agents[number], state.reports[number])
    state.agent_hour[0, number] = state.head[0].hour
    state.agent_report[0, number] = number
