"""Flights and work between two events: both are linear in time, so no step size is needed."""

import math

from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.missions.chance import PACE, uniform
from alloc.problems.missions.radio import Pace
from alloc.problems.missions.simulation.places import Distances, Place
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    STAY,
    AgentFacts,
    AgentState,
    AgentStatus,
    Flight,
    MissionState,
    TaskFacts,
    TaskState,
    TaskStatus,
)

CLOSE = 1e-9
"""Share of a task's work that may be left at its deadline, to allow for rounding errors."""


def refusal(
    distances: Distances, agent: AgentFacts, place: Place, battery: float, goal: Place, task: TaskFacts | None
) -> str | None:
    """Return why an agent at a place cannot fly to a goal, and work there if it is a task; None if it can.

    The agent must be allowed to do the task, the goal within its range, and its battery sufficient for the flight, and
    for the flight home if it returns.
    """
    if task is not None:
        if agent.tasks is not None and task.id not in agent.tasks:
            return "the agent may not do this task"
        if not task.needs <= agent.skills:
            return f"the agent has not all skills: {', '.join(sorted(task.needs - agent.skills))}"
    distance = distances.between(place, goal)
    if distance == math.inf:
        return "there is no way"
    if distance > agent.range + TOLERANCE:
        return f"it is {distance:g} away, range {agent.range:g}"
    home = distances.between(_reached(place, goal), agent.home) if agent.returns else 0.0
    if home == math.inf:
        return "there is no way back"
    energy = agent.energy_per_distance * (distance + home)
    return None if energy <= battery + TOLERANCE else f"the flight takes {energy:g} of energy, battery {battery:g}"


def place_at(state: MissionState, agent: AgentState) -> Place:
    """Return the present place of an agent; in flight, it is not a node of a distance table."""
    flight = agent.flight
    if flight is None:
        return agent.place
    position = state.distances.on_the_way(flight.source.position, flight.goal.position, flight.share(state.hour))
    return Place(position)


def battery_at(state: MissionState, agent: AgentState) -> float:
    """Return the present battery of an agent."""
    if agent.flight is None:
        return agent.battery
    flown = agent.flight.distance * agent.flight.share(state.hour)
    return agent.battery - agent.facts.energy_per_distance * flown


def depart(state: MissionState, agent: AgentState, goal: Place, task: TaskState | None) -> None:
    """Begin the flight of a stationary agent."""
    distance = state.distances.between(agent.place, goal)
    hours = distance / agent.facts.speed
    agent.flight = Flight(agent.place, goal, task, distance, state.hour, state.hour + hours)
    agent.status = AgentStatus.FLYING


def break_off(state: MissionState, agent: AgentState) -> None:
    """End a flight at the agent's present place."""
    flight = agent.flight
    if flight is not None:
        share = flight.share(state.hour)
        place = _reached(flight.source, flight.goal) if share == 1 else place_at(state, agent)
        _land(agent, flight, share * flight.distance, flight.source if share == 0 else place)
        agent.has_flown = agent.has_flown or share > 0


def _reached(source: Place, goal: Place) -> Place:
    """Return the place reached by a flight to a goal; with an unknown goal, the agent stays at its source."""
    return goal if goal.position is not None else Place(source.position, goal.nodes)


def _land(agent: AgentState, flight: Flight, flown: float, place: Place) -> None:
    energy = agent.facts.energy_per_distance * flown
    agent.distance += flown
    agent.energy += energy
    agent.battery -= energy
    agent.place, agent.flight, agent.status = place, None, AgentStatus.IDLE


def begin_work(state: MissionState, agent: AgentState, task: TaskState) -> None:
    """Let an agent at an open task start to work there."""
    bring_up_to_date(state, task)
    task.workers[agent.index] = agent
    task.begun = True
    task.version += 1
    agent.task, agent.status = task, AgentStatus.WORKING


def stop_work(state: MissionState, agent: AgentState) -> None:
    """Let an agent stop working, if it does."""
    task = agent.task
    if task is not None:
        bring_up_to_date(state, task)
        del task.workers[agent.index]
        task.version += 1
        agent.task, agent.status = None, AgentStatus.IDLE


def close(state: MissionState, task: TaskState, status: TaskStatus) -> None:
    """Close a task as done, missed or cancelled: the work left is written off, and its agents become idle."""
    bring_up_to_date(state, task)
    if status is TaskStatus.DONE:
        task.done += task.left  # rounding
    elif status is TaskStatus.MISSED:
        task.missed += task.left
    else:
        task.cancelled += task.left
    task.left, task.status, task.closed = 0.0, status, state.hour
    task.version += 1
    for agent in task.workers.values():
        agent.task, agent.status, agent.order = None, AgentStatus.IDLE, STAY
    task.workers.clear()


def status_at_deadline(state: MissionState, task: TaskState) -> TaskStatus:
    """Return the status of an open task at its deadline: missed, unless only a rounding error is left."""
    bring_up_to_date(state, task)
    is_done = task.left <= CLOSE * (task.appeared + task.grown)
    return TaskStatus.DONE if is_done else TaskStatus.MISSED


def bring_up_to_date(state: MissionState, task: TaskState) -> None:
    """Update the work left of an open task to the present hour by the work done, or growth, since its last update."""
    if task.status is TaskStatus.OPEN:
        if task.workers:
            ability = sum(agent.facts.ability for agent in task.workers.values())
            work = min(task.left, ability * paced_hours(state, task, task.since, state.hour))
            task.left -= work
            task.done += work
        elif not task.begun:
            grown = task.facts.growth * (state.hour - task.since)
            task.left += grown
            task.grown += grown
    task.since = state.hour


def work_left(state: MissionState, task: TaskState) -> float:
    """Return the present work left of a task, without updating it."""
    if task.status is TaskStatus.OPEN and task.workers:
        ability = sum(agent.facts.ability for agent in task.workers.values())
        return max(0.0, task.left - ability * paced_hours(state, task, task.since, state.hour))
    if task.status is TaskStatus.OPEN and not task.begun:
        return task.left + task.facts.growth * (state.hour - task.since)
    return task.left


def completion_hour(state: MissionState, task: TaskState) -> float:
    """Return the hour at which an up-to-date task is done if nothing changes; ``inf`` if not within the mission."""
    if not task.workers:
        return math.inf
    needed = task.left / sum(agent.facts.ability for agent in task.workers.values())
    pace, end = state.mission.pace, min(state.mission.end, task.facts.deadline)
    if pace is None:
        return task.since + needed
    begin = task.since
    while begin <= end:
        period = math.floor(begin / pace.period)
        until = max((period + 1) * pace.period, math.nextafter(begin, math.inf))
        factor = pace_factor(state.mission.seed, task.index, period, pace)
        if factor * (until - begin) >= needed:
            return begin + needed / factor
        needed -= factor * (until - begin)
        begin = until
    return math.inf


def paced_hours(state: MissionState, task: TaskState, begin: float, end: float) -> float:
    """Return the integral of a task's pace factor between two hours."""
    pace = state.mission.pace
    if pace is None:
        return end - begin
    total = 0.0
    while begin < end:
        period = math.floor(begin / pace.period)
        until = min(end, max((period + 1) * pace.period, math.nextafter(begin, math.inf)))
        total += pace_factor(state.mission.seed, task.index, period, pace) * (until - begin)
        begin = until
    return total


def pace_factor(seed: int, task: int, period: int, pace: Pace) -> float:
    """Return the pace factor of a task in a period."""
    return pace.low + (pace.high - pace.low) * uniform(PACE, seed, task, period)


def end_flights(state: MissionState) -> None:
    """After the end of the mission, let agents in flight reach their goals, and those that return fly home.

    An agent that has flown has enough battery for that; one that has not stays at its start, whatever its base.
    """
    for agent in state.agents:
        if agent.flight is not None:
            _land(agent, agent.flight, agent.flight.distance, _reached(agent.flight.source, agent.flight.goal))
            agent.has_flown = True
        if agent.facts.returns and agent.has_flown and agent.status in ACTIVE:
            stop_work(state, agent)
            distance = state.distances.between(agent.place, agent.facts.home)
            flight = Flight(agent.place, agent.facts.home, None, distance, state.hour, state.hour)
            _land(agent, flight, distance, agent.facts.home)
