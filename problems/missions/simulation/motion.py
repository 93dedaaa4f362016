"""Flights and work between two events: everything is straight or linear, so nothing needs a step size."""

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
"""Part of a task's work that is forgiven at its deadline, against rounding errors."""


def refusal(
    distances: Distances, agent: AgentFacts, place: Place, battery: float, goal: Place, task: TaskFacts | None
) -> str | None:
    """Return why an agent at a place cannot fly to a goal, and work there if it is a task; None if it can.

    It must be allowed to, within its range, and its battery must be enough for the flight, and for the way home if it
    returns.
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
    """Return where an agent is now; in flight that is no node of a table."""
    flight = agent.flight
    if flight is None:
        return agent.place
    position = state.distances.on_the_way(flight.source.position, flight.goal.position, flight.share(state.hour))
    return Place(position)


def battery_at(state: MissionState, agent: AgentState) -> float:
    """Return the battery of an agent now."""
    if agent.flight is None:
        return agent.battery
    flown = agent.flight.distance * agent.flight.share(state.hour)
    return agent.battery - agent.facts.energy_per_distance * flown


def depart(state: MissionState, agent: AgentState, goal: Place, task: TaskState | None) -> None:
    """Let an agent that stands still begin a flight."""
    distance = state.distances.between(agent.place, goal)
    hours = distance / agent.facts.speed
    agent.flight = Flight(agent.place, goal, task, distance, state.hour, state.hour + hours)
    agent.status = AgentStatus.FLYING


def break_off(state: MissionState, agent: AgentState) -> None:
    """End a flight where the agent is now."""
    flight = agent.flight
    if flight is not None:
        share = flight.share(state.hour)
        place = _reached(flight.source, flight.goal) if share == 1 else place_at(state, agent)
        _land(agent, flight, share * flight.distance, flight.source if share == 0 else place)
        agent.has_flown = agent.has_flown or share > 0


def _reached(source: Place, goal: Place) -> Place:
    """Return the goal; an agent that goes to an unknown place is still where it was."""
    return goal if goal.position is not None else Place(source.position, goal.nodes)


def _land(agent: AgentState, flight: Flight, flown: float, place: Place) -> None:
    energy = agent.facts.energy_per_distance * flown
    agent.distance += flown
    agent.energy += energy
    agent.battery -= energy
    agent.place, agent.flight, agent.status = place, None, AgentStatus.IDLE


def begin_work(state: MissionState, agent: AgentState, task: TaskState) -> None:
    """Let an agent that is at an open task join those who work there."""
    bring_up_to_date(state, task)
    task.workers[agent.index] = agent
    task.begun = True
    task.version += 1
    agent.task, agent.status = task, AgentStatus.WORKING


def stop_work(state: MissionState, agent: AgentState) -> None:
    """Let an agent leave the task where it works, if there is one."""
    task = agent.task
    if task is not None:
        bring_up_to_date(state, task)
        del task.workers[agent.index]
        task.version += 1
        agent.task, agent.status = None, AgentStatus.IDLE


def close(state: MissionState, task: TaskState, status: TaskStatus) -> None:
    """Let a task be done, missed or cancelled now: what is left is written off, and who worked there is idle."""
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
    """Return what becomes of an open task at its deadline: it is missed, unless only rounding errors are left."""
    bring_up_to_date(state, task)
    is_done = task.left <= CLOSE * (task.appeared + task.grown)
    return TaskStatus.DONE if is_done else TaskStatus.MISSED


def bring_up_to_date(state: MissionState, task: TaskState) -> None:
    """Count what was worked, or grew, on an open task since it was brought up to date."""
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
    """Return the work left of a task now, without a change to it."""
    if task.status is TaskStatus.OPEN and task.workers:
        ability = sum(agent.facts.ability for agent in task.workers.values())
        return max(0.0, task.left - ability * paced_hours(state, task, task.since, state.hour))
    if task.status is TaskStatus.OPEN and not task.begun:
        return task.left + task.facts.growth * (state.hour - task.since)
    return task.left


def completion_hour(state: MissionState, task: TaskState) -> float:
    """Return when a task that is up to date will be done if nothing changes; ``inf`` if it will not in the mission."""
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
    """Return the hours between two hours, each counted as often as the pace says."""
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
    """Return how fast any group works on a task in a period."""
    return pace.low + (pace.high - pace.low) * uniform(PACE, seed, task, period)


def end_flights(state: MissionState) -> None:
    """Let agents in flight land at their goals after the end of the mission, and those that return fly home.

    Who has flown can afford that; who has not is still where it began, whatever its base.
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
