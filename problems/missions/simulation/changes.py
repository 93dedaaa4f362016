"""Effects of events and orders on agents and tasks."""

from alloc.problems.missions.events import Event, EventKind
from alloc.problems.missions.simulation.motion import (
    battery_at,
    begin_work,
    break_off,
    bring_up_to_date,
    close,
    depart,
    place_at,
    refusal,
    stop_work,
    work_left,
)
from alloc.problems.missions.simulation.places import Place
from alloc.problems.missions.simulation.state import (
    ACTIVE,
    STAY,
    AgentState,
    AgentStatus,
    MissionState,
    Order,
    TaskState,
    TaskStatus,
)


def happen(state: MissionState, event: Event) -> None:
    """Apply an event now; if its agent has failed or its task is closed, nothing changes."""
    if event.agent is not None and event.kind is not EventKind.RADIO_SILENT:
        _happen_to_agent(state, state.agent(event.agent), event)
    elif event.task is not None:
        _happen_to_task(state, state.task(event.task), event)


def _happen_to_agent(state: MissionState, agent: AgentState, event: Event) -> None:
    if event.kind in (EventKind.AGENT_JOINS, EventKind.AGENT_RETURNS):
        agent.status = AgentStatus.IDLE
    elif event.kind is EventKind.AGENT_RECHARGES:
        assert event.amount is not None
        agent.battery += event.amount
        agent.capacity += event.amount
    else:
        stand_still(state, agent)
        agent.order = STAY
        agent.status = AgentStatus.FAILED if event.kind is EventKind.AGENT_FAILS else AgentStatus.AWAY


def _happen_to_task(state: MissionState, task: TaskState, event: Event) -> None:
    if event.kind is EventKind.TASK_APPEARS:
        task.status, task.since = TaskStatus.OPEN, state.hour
        task.appeared = task.left = task.workload
        if task.workload == 0:
            close(state, task, TaskStatus.DONE)
    elif task.status is TaskStatus.OPEN and event.kind is EventKind.TASK_CANCELLED:
        close(state, task, TaskStatus.CANCELLED)
    elif task.status is TaskStatus.OPEN:
        assert event.workload is not None
        bring_up_to_date(state, task)
        task.appeared += max(0.0, event.workload - task.left)
        task.cancelled += max(0.0, task.left - event.workload)
        task.left = event.workload
        task.version += 1
        if task.left == 0:
            close(state, task, TaskStatus.DONE)


def stand_still(state: MissionState, agent: AgentState) -> None:
    """End an agent's flight or work at its present place."""
    stop_work(state, agent)
    break_off(state, agent)


def goal_of(state: MissionState, order: Order) -> tuple[Place, TaskState | None]:
    """Return the place and the task to which an order leads."""
    if order.task is None:
        return Place(order.position), None
    task = state.task(order.task)
    return task.facts.place, task


def obey(state: MissionState, agent: AgentState, order: Order) -> str | None:
    """Let an agent follow an order as far as possible now; return why it refuses, None if it does not.

    An agent also flies to a closed task, which it may not know to be closed until it arrives. If distances are given by
    a table, an agent in flight follows the order only from the end of that flight.
    """
    if agent.status not in ACTIVE:
        return f"the agent is {agent.status}"
    if order.task is None and order.position is None:
        _count_switch(state, agent, None)
        if not (state.distances.has_table and agent.flight is not None):
            stand_still(state, agent)
        agent.order = order
        return None
    goal, task = goal_of(state, order)
    if task is not None and task.status is TaskStatus.TO_COME:
        return "the task is to come"
    if task is not None and agent.task is task:
        agent.order = order
        return None
    bound = state.distances.has_table and agent.flight is not None
    place = agent.flight.goal if bound and agent.flight is not None else place_at(state, agent)
    battery = battery_at(state, agent) if not bound else _battery_at_goal(agent)
    problem = refusal(state.distances, agent.facts, place, battery, goal, None if task is None else task.facts)
    if problem is not None:
        return problem
    _count_switch(state, agent, task)
    agent.order = order
    if not bound:
        stand_still(state, agent)
        go(state, agent, goal, task)
    return None


def go(state: MissionState, agent: AgentState, goal: Place, task: TaskState | None) -> None:
    """Let a stationary agent fly to a goal; if the flight takes no time, it arrives at once."""
    depart(state, agent, goal, task)
    flight = agent.flight
    assert flight is not None
    if flight.arrives <= state.hour:
        land(state, agent)


def land(state: MissionState, agent: AgentState) -> None:
    """End a flight at its goal: the agent works there, follows a later order, or is idle."""
    flight = agent.flight
    assert flight is not None
    break_off(state, agent)
    goal, task = goal_of(state, agent.order)
    if agent.order != STAY and not _leads_to(flight.task, flight.goal, task, goal):
        facts = None if task is None else task.facts
        if refusal(state.distances, agent.facts, agent.place, agent.battery, goal, facts) is None:
            go(state, agent, goal, task)
        else:
            agent.order = STAY
    elif task is not None and task.status is TaskStatus.OPEN:
        begin_work(state, agent, task)
    else:
        agent.order = STAY


def _leads_to(task: TaskState | None, place: Place, wanted: TaskState | None, goal: Place) -> bool:
    return task is wanted and (task is not None or place == goal)


def _battery_at_goal(agent: AgentState) -> float:
    assert agent.flight is not None
    return agent.battery - agent.facts.energy_per_distance * agent.flight.distance


def _count_switch(state: MissionState, agent: AgentState, task: TaskState | None) -> None:
    """Count an order that sends a flying or working agent elsewhere while its task has work left."""
    left = agent.task
    if agent.flight is not None and agent.order.task is not None:
        left = state.task(agent.order.task)
    if left is not None and left is not task and left.status is TaskStatus.OPEN and work_left(state, left) > 0:
        state.switches += 1
