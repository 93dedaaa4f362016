"""What agents see and hear, compiled: see `alloc.problems.missions.simulation.awareness`."""

import math

import numpy as np

from alloc.allocators.missions.layout import ABSENT, IDLE, NOBODY, OPEN, TO_COME, TO_TASK, WORKING, MissionArrays
from alloc.allocators.missions.motion import battery_of, place_of, work_left
from alloc.allocators.runtime.compiled import compiled

INVISIBLE = -9.0
"""What is seen of a task that is to come."""


@compiled
def see_all(state: MissionArrays) -> None:
    """Fill in where all agents are, and what is seen of all tasks."""
    hour = state.head[0].hour
    for number in range(len(state.agents)):
        x, y, z = place_of(state.agents[number], hour)
        state.places[0, number], state.places[1, number], state.places[2, number] = x, y, z
    for number in range(len(state.tasks)):
        state.now[number] = seen_of(state, number)


@compiled
def seen_of(state: MissionArrays, number: int) -> float:
    """Return the work left of a task, minus its status where it is closed."""
    status = state.tasks[number].status
    if status == OPEN:
        return work_left(state, number)
    return INVISIBLE if status == TO_COME else -float(status)


@compiled
def look_around(state: MissionArrays, number: int) -> None:
    """Let an agent see all tasks and all agents in the mission within its sensing radius."""
    head, agent = state.head[0], state.agents[number]
    agent.looked = head.turn
    hour, sensing = head.hour, head.sensing
    x, y, z = state.places[0, number], state.places[1, number], state.places[2, number]
    for other in range(len(state.agents)):
        if other == number or (
            IDLE <= state.agents[other].status <= WORKING
            and is_within(sensing, head.is_manhattan, x, y, z, state.places, other)
        ):
            state.agent_hour[number, other] = hour
            state.agent_report[number, other] = report_on(state, other)
    for task in range(len(state.tasks)):
        left = state.now[task]
        if left != INVISIBLE and is_within(sensing, head.is_manhattan, x, y, z, state.sites, task):
            state.task_hour[number, task] = hour
            state.task_left[number, task] = left


@compiled
def is_within(radius: float, is_manhattan: int, x: float, y: float, z: float, places: np.ndarray, number: int) -> bool:
    """Whether a place is within a radius; one that is unknown is."""
    dx, dy, dz = places[0, number] - x, places[1, number] - y, places[2, number] - z
    distance = abs(dx) + abs(dy) + abs(dz) if is_manhattan else math.sqrt(dx * dx + dy * dy + dz * dz)
    return not distance > radius


@compiled
def report_on(state: MissionArrays, number: int) -> int:
    """Return the number of the report of what is true of an agent now, the same for all who see it in a turn."""
    head, agent = state.head[0], state.agents[number]
    if agent.reported != head.turn:
        if head.reports == len(state.reports):
            drop_unknown(state)
        agent.report, agent.reported = head.reports, head.turn
        head.reports += 1
        write_report(state, number, agent.report)
    return agent.report


@compiled
def write_report(state: MissionArrays, number: int, place: int) -> None:
    """Write a report of an agent."""
    agent, report, hour = state.agents[number], state.reports[place], state.head[0].hour
    report.x, report.y, report.z = place_of(agent, hour)
    report.status, report.battery = agent.status, battery_of(agent, hour)
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
def renumber(known: np.ndarray, number: np.ndarray) -> None:
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
            state.task_left[0, number] = seen_of(state, number)


@compiled
def tell_all(state: MissionArrays, number: int) -> None:
    """Let all know what is so of an agent now."""
    write_report(state, number, number)
    state.agent_hour[0, number] = state.head[0].hour
    state.agent_report[0, number] = number


@compiled
def hear(hour: np.ndarray, value: np.ndarray, told_hour: np.ndarray, told: np.ndarray) -> None:
    """Take over what is newer in a message than what is known."""
    for place in range(len(hour)):
        newer = told_hour[place] > hour[place]
        value[place] = told[place] if newer else value[place]
        hour[place] = told_hour[place] if newer else hour[place]
