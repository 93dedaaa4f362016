"""Flights and work between two events, compiled: see `alloc.problems.missions.simulation.motion`."""

import math
from collections.abc import Sequence

import numpy as np

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.layout import FLYING, IDLE, NOBODY, OPEN, WORKING
from alloc.allocators.missions.records import Agent, Head, Task
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.distances.reach import TOLERANCE

Point = tuple[float, float, float]


@compiled_in_place
def distance_between(is_manhattan: int, one: Point, other: Point) -> float:
    """Return the distance between two places, 0 if one is unknown."""
    x, y, z = one[0] - other[0], one[1] - other[1], one[2] - other[2]
    distance = abs(x) + abs(y) + abs(z) if is_manhattan else math.sqrt(x * x + y * y + z * z)
    return 0.0 if math.isnan(distance) else distance


@compiled_in_place
def flown_share(agent: Agent, hour: float) -> float:
    """Return the share of an agent's flight that has been flown."""
    hours = agent.arrives - agent.departs
    return 1.0 if hours <= 0 else min(1.0, max(0.0, (hour - agent.departs) / hours))


@compiled_in_place
def place_of(agent: Agent, hour: float) -> Point:
    """Return the present place of an agent."""
    if agent.flight == 0 or math.isnan(agent.x) or math.isnan(agent.goal_x):
        return agent.x, agent.y, agent.z
    share = flown_share(agent, hour)
    return (
        agent.x + share * (agent.goal_x - agent.x),
        agent.y + share * (agent.goal_y - agent.y),
        agent.z + share * (agent.goal_z - agent.z),
    )


@compiled_in_place
def battery_of(agent: Agent, hour: float) -> float:
    """Return the present battery of an agent."""
    if agent.flight == 0:
        return agent.battery
    return agent.battery - agent.energy_per_distance * (agent.length * flown_share(agent, hour))


@compiled_in_place
def can_fly(is_manhattan: int, agent: Agent, place: Point, battery: float, goal: Point) -> bool:
    """Whether an agent at a place can fly to a goal by its range and battery, and home if it returns."""
    distance = distance_between(is_manhattan, place, goal)
    if distance > agent.range + TOLERANCE:
        return False
    if agent.returns:
        reached = place if math.isnan(goal[0]) else goal
        distance += distance_between(is_manhattan, reached, (agent.home_x, agent.home_y, agent.home_z))
    return agent.energy_per_distance * distance <= battery + TOLERANCE


@compiled_in_place
def depart(head: Head, agent: Agent, goal: Point) -> None:
    """Begin the flight of a stationary agent."""
    agent.length = distance_between(head.is_manhattan, (agent.x, agent.y, agent.z), goal)
    agent.goal_x, agent.goal_y, agent.goal_z = goal
    agent.departs, agent.arrives = head.hour, head.hour + agent.length / agent.speed
    agent.flights += 1
    agent.flight, agent.status = agent.flights, FLYING


@compiled_in_place
def break_off(agent: Agent, hour: float) -> None:
    """End a flight, if there is one, at the agent's present place."""
    if agent.flight == 0:
        return
    share = flown_share(agent, hour)
    place = place_of(agent, hour)
    goes_on = share > 0 and not math.isnan(agent.goal_x)
    flown = share * agent.length
    agent.distance += flown
    agent.energy += agent.energy_per_distance * flown
    agent.battery -= agent.energy_per_distance * flown
    agent.flight, agent.status = 0, IDLE
    if share > 0:
        agent.flown = 1
    if goes_on and share == 1:
        agent.x, agent.y, agent.z = agent.goal_x, agent.goal_y, agent.goal_z
    elif goes_on:
        agent.x, agent.y, agent.z = place


@compiled_in_place
def begin_work(head: Head, agents: Sequence[Agent], tasks: Sequence[Task], number: int, at: int) -> None:
    """Let an agent at an open task start to work there."""
    agent, task = agents[number], tasks[at]
    bring_up_to_date(head, agents, task, at)
    agent.previous, agent.next = task.last, NOBODY
    if task.last == NOBODY:
        task.first = number
    else:
        agents[task.last].next = number
    task.last = number
    task.begun = 1
    task.version += 1
    agent.task, agent.status = at, WORKING


@compiled_in_place
def stop_work(head: Head, agents: Sequence[Agent], tasks: Sequence[Task], number: int) -> None:
    """Let an agent stop working, if it does."""
    agent = agents[number]
    if agent.task == NOBODY:
        return
    task = tasks[agent.task]
    bring_up_to_date(head, agents, task, agent.task)
    if agent.previous == NOBODY:
        task.first = agent.next
    else:
        agents[agent.previous].next = agent.next
    if agent.next == NOBODY:
        task.last = agent.previous
    else:
        agents[agent.next].previous = agent.previous
    task.version += 1
    agent.task, agent.status = NOBODY, IDLE


@compiled_in_place
def ability_at(agents: Sequence[Agent], task: Task) -> float:
    """Return the total ability of the agents that work at a task."""
    total, number = 0.0, task.first
    while number != NOBODY:
        total += agents[number].ability
        number = agents[number].next
    return total


@compiled_in_place
def bring_up_to_date(head: Head, agents: Sequence[Agent], task: Task, number: int) -> None:
    """Update the work left of an open task to the present hour by the work done, or growth, since its last update."""
    hour = head.hour
    if task.status == OPEN:
        if task.first != NOBODY:
            work = min(task.left, ability_at(agents, task) * paced_hours(head, number, task.since, hour))
            task.left -= work
            task.done += work
        elif not task.begun:
            grown = task.growth * (hour - task.since)
            task.left += grown
            task.grown += grown
    task.since = hour


@compiled_in_place
def work_left(head: Head, agents: Sequence[Agent], task: Task, number: int) -> float:
    """Return the present work left of a task, without updating it."""
    hour = head.hour
    if task.status == OPEN and task.first != NOBODY:
        return max(0.0, task.left - ability_at(agents, task) * paced_hours(head, number, task.since, hour))
    if task.status == OPEN and not task.begun:
        return task.left + task.growth * (hour - task.since)
    return task.left


@compiled_in_place
def completion_hour(head: Head, agents: Sequence[Agent], task: Task, number: int) -> float:
    """Return the hour at which an up-to-date task is done if nothing changes; ``inf`` if not within the mission."""
    needed = task.left / ability_at(agents, task)
    if not head.has_pace:
        return task.since + needed
    begin, end = task.since, min(head.end, task.deadline)
    while begin <= end:
        period = math.floor(begin / head.pace_period)
        until = max((period + 1) * head.pace_period, np.nextafter(begin, np.inf))
        factor = pace_factor(head, number, int(period))
        if factor * (until - begin) >= needed:
            return begin + needed / factor
        needed -= factor * (until - begin)
        begin = until
    return np.inf


@compiled_in_place
def paced_hours(head: Head, number: int, begin: float, end: float) -> float:
    """Return the integral of a task's pace factor between two hours."""
    if not head.has_pace:
        return end - begin
    total = 0.0
    while begin < end:
        period = math.floor(begin / head.pace_period)
        until = min(end, max((period + 1) * head.pace_period, np.nextafter(begin, np.inf)))
        total += pace_factor(head, number, int(period)) * (until - begin)
        begin = until
    return total


@compiled_in_place
def pace_factor(head: Head, number: int, period: int) -> float:
    """Return the pace factor of a task in a period."""
    chance = fraction(keyed(keyed(head.pace_key, number), period))
    return head.pace_low + (head.pace_high - head.pace_low) * chance
