"""Correction of a planner's state by reports of agents."""

from alloc.allocators.online.planner.inputs import Report
from alloc.problems.missions.simulation.changes import go, goal_of
from alloc.problems.missions.simulation.motion import battery_at, break_off, refusal, stop_work
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.state import ACTIVE, STAY, AgentState, MissionState, TaskStatus


def correct(state: MissionState, agent: AgentState, report: Report) -> str | None:
    """Set an agent's place and battery as reported, and let it continue its order.

    Parameters
    ----------
    state : MissionState
    agent : AgentState
    report : Report
        A consistent report.

    Returns
    -------
    str or None
        Why it cannot continue, so that it has no order now; None if it can.
    """
    place = _place(state, report)
    if place is None and agent.flight is not None and state.distances.has_table:
        _recharge_on_the_way(state, agent, report.battery)
        return None
    if agent.flight is not None or (place is not None and place != agent.place):
        stop_work(state, agent)
        break_off(state, agent)
        agent.place = agent.place if place is None else place
    if report.battery is not None:
        agent.battery = report.battery
        agent.capacity = report.battery + agent.energy
    if agent.task is not None or agent.order == STAY or agent.status not in ACTIVE:
        return None
    goal, task = goal_of(state, agent.order)
    problem = None if task is None or task.status is TaskStatus.OPEN else f"the task is {task.status}"
    if problem is None:
        facts = None if task is None else task.facts
        problem = refusal(state.distances, agent.facts, agent.place, agent.battery, goal, facts)
    if problem is not None:
        agent.order = STAY
        return problem
    go(state, agent, goal, task)
    return None


def _place(state: MissionState, report: Report) -> Place | None:
    if report.task is not None:
        return state.task(report.task).facts.place
    if report.position is None:
        return None
    x, y, z = report.position
    return Place((x, y, z))


def _recharge_on_the_way(state: MissionState, agent: AgentState, battery: float | None) -> None:
    """Set the battery in a flight that cannot be diverted, to at least the energy needed to complete it."""
    assert agent.flight is not None
    assert battery is not None
    needed = agent.facts.energy_per_distance * agent.flight.distance
    agent.battery = max(needed, agent.battery + battery - battery_at(state, agent))
    agent.capacity = agent.battery + agent.energy
