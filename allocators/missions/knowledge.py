"""Sensing of agents, compiled: see `alloc.problems.missions.simulation.awareness`."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.missions.grid import SLACK, cells_near, comparable_length, drift, find_within, limit_of, locate
from alloc.allocators.missions.layout import ABSENT, IDLE, OPEN, TO_COME, WORKING, MissionArrays
from alloc.allocators.missions.motion import Point, place_of, work_left
from alloc.allocators.missions.records import Agent, Head, Task
from alloc.allocators.missions.reports import drop_unknown, learn, report_now, write_report
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.distances.reach import TOLERANCE


@compiled_in_place
def look_around(state: MissionArrays, is_located: bool) -> None:
    """Let the agents listed in `lookers` sense all tasks and agents of the mission within their sensing radius.

    Parameters
    ----------
    state : MissionArrays
    is_located : bool
        Whether the grid is to be filled with the agents' present places.
    """
    head = state.head[0]
    if head.reports + len(state.agents) > head.limit:
        drop_unknown(state)
    head.looks += 1
    is_located = is_located or not drift(head) <= head.side
    if is_located:
        locate(head, state.agents, state.places, state.cells, state.in_cells)
    note_tasks(state)
    limit = limit_of(head.is_manhattan, head.sensing + TOLERANCE)
    for place in range(head.lookers):
        number = state.lookers[place]
        here = place_of(state.agents[number], head.hour)
        see_tasks(state, number, here, limit)
        see_agents(state, number, here, limit, is_located)
    head.lookers = 0


@inlined
def note_tasks(state: MissionArrays) -> None:
    """Note what sensing each task yields now, NaN for tasks still to come."""
    head = state.head[0]
    for number in range(len(state.tasks)):
        task = state.tasks[number]
        is_there = task.status != TO_COME
        state.task_now[number] = seen_of(head, state.agents, task, number) if is_there else np.nan


@inlined
def see_tasks(state: MissionArrays, number: int, here: Point, limit: float) -> None:
    """Update an agent's knowledge of the tasks that it senses; `limit` is the sensing radius, by `limit_of`."""
    head, hours, left = state.head[0], state.task_hour[number], state.task_left[number]
    hour, is_manhattan = head.hour, head.is_manhattan
    at_x, at_y, at_z = state.sites[0], state.sites[1], state.sites[2]
    x, y, z = here
    for at in range(len(state.task_now)):  # without branches, so that the loop is vectorised
        now, known, known_left = state.task_now[at], hours[at], left[at]
        is_far = comparable_length(is_manhattan, at_x[at] - x, at_y[at] - y, at_z[at] - z) > limit
        is_seen = (not is_far) & (now == now)
        hours[at] = hour if is_seen else known
        left[at] = now if is_seen else known_left


@compiled_in_place
def seen_of(head: Head, agents: Sequence[Agent], task: Task, number: int) -> float:
    """Return the work left of a task, or minus its status if it is closed."""
    return work_left(head, agents, task, number) if task.status == OPEN else -float(task.status)


@inlined
def see_agents(state: MissionArrays, number: int, here: Point, limit: float, is_located: bool) -> None:
    """Update an agent's knowledge of the agents that it senses; `is_located` if the grid has their present places."""
    head, output = state.head[0], (state.is_near, state.near)
    reach, reach_limit, is_manhattan = head.sensing + TOLERANCE, limit, head.is_manhattan
    if not is_located:
        reach = (reach + drift(head)) * (1 + SLACK)
        reach_limit = limit_of(is_manhattan, reach)
    first, last, low, high = cells_near(head, here[0], here[1], reach)
    for row in range(low, high + 1):
        begin, end = state.cells[row * head.columns + first], state.cells[row * head.columns + last + 1]
        for place in range(find_within(is_manhattan, reach_limit, here, state.places, begin, end, output)):
            other = state.in_cells[state.near[place]]
            agent = state.agents[other]
            if not IDLE <= agent.status <= WORKING:
                continue
            if not is_located:
                at = place_of(agent, head.hour)
                if comparable_length(is_manhattan, at[0] - here[0], at[1] - here[1], at[2] - here[2]) > limit:
                    continue
            if agent.reported != head.looks:
                report_now(state, agent)
            learn(state, number, other, agent.report)


@compiled_in_place
def refresh(state: MissionArrays) -> None:
    """Give all agents full knowledge of the present state."""
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
    """Give all agents the present state of one agent."""
    write_report(state, state.agents[number], state.reports[number + 1])
    learn(state, 0, number, number + 1)
