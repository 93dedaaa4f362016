"""Effects of orders, and closing of tasks, compiled: see `alloc.problems.missions.simulation.changes`."""

from alloc.allocators.missions.agenda import push
from alloc.allocators.missions.knowledge import tell_all
from alloc.allocators.missions.layout import (
    CANCELLED,
    DONE,
    FLYING,
    IDLE,
    MISSED,
    NOBODY,
    OPEN,
    STAY,
    TO_COME,
    TO_PLACE,
    TO_TASK,
    WORKING,
    MissionArrays,
)
from alloc.allocators.missions.motion import (
    Point,
    battery_of,
    begin_work,
    break_off,
    bring_up_to_date,
    can_fly,
    completion_hour,
    depart,
    place_of,
    stop_work,
    work_left,
)
from alloc.allocators.missions.records import Agent
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.missions.simulation.agenda import Turn

ARRIVAL, COMPLETION = int(Turn.ARRIVAL), int(Turn.COMPLETION)


@compiled_in_place
def note_task(state: MissionArrays, number: int) -> None:
    """Note that the completion of a task has to be rescheduled."""
    task, head = state.tasks[number], state.head[0]
    if number != NOBODY and not task.changed:
        task.changed = 1
        state.changed_tasks[head.changed_tasks] = number
        head.changed_tasks += 1


@compiled_in_place
def note_agent(state: MissionArrays, number: int, left: int) -> None:
    """Note that an agent's arrival, and the completion of its task and of the one it left, have to be rescheduled."""
    agent, head = state.agents[number], state.head[0]
    if not agent.changed:
        agent.changed = 1
        state.changed_agents[head.changed_agents] = number
        head.changed_agents += 1
    note_task(state, left)
    note_task(state, agent.task)


@compiled_in_place
def let_decide(state: MissionArrays, number: int) -> None:
    """Note that an agent has to decide once everything at this hour has happened."""
    agent, head = state.agents[number], state.head[0]
    if not agent.decides:
        agent.decides = 1
        state.marked[head.marked] = number
        head.marked += 1


@compiled_in_place
def balance(state: MissionArrays) -> None:
    """Schedule the arrivals of all changed agents and the completions of all changed tasks."""
    head = state.head[0]
    agents, tasks = head.changed_agents, head.changed_tasks
    head.changed_agents = head.changed_tasks = 0
    for place in range(agents):
        number = state.changed_agents[place]
        agent = state.agents[number]
        agent.changed = 0
        if agent.flight:
            push(state, agent.arrives, ARRIVAL, number, agent.flight)
    for place in range(tasks):
        number = state.changed_tasks[place]
        task = state.tasks[number]
        task.changed = 0
        if task.first != NOBODY:
            bring_up_to_date(head, state.agents, task, number)
            hour = completion_hour(head, state.agents, task, number)
            if hour < float("inf"):
                push(state, max(hour, head.hour), COMPLETION, number, task.version)


@compiled_in_place
def close(state: MissionArrays, number: int, status: int) -> None:
    """Close a task as done, missed or cancelled; its agents become idle and have to decide."""
    task, head = state.tasks[number], state.head[0]
    bring_up_to_date(head, state.agents, task, number)
    if status == DONE:
        task.done += task.left
    elif status == MISSED:
        task.missed += task.left
    elif status == CANCELLED:
        task.cancelled += task.left
    task.left, task.status, task.closed = 0.0, status, head.hour
    task.version += 1
    head.unfinished -= 1
    head.is_news = 1
    note_task(state, number)
    worker = task.first
    task.first = task.last = NOBODY
    while worker != NOBODY:
        agent = state.agents[worker]
        agent.task, agent.status, agent.order = NOBODY, IDLE, STAY
        let_decide(state, worker)
        note_agent(state, worker, NOBODY)
        worker = agent.next


@compiled_in_place
def stand_still(state: MissionArrays, number: int) -> None:
    """End an agent's flight or work at its present place."""
    stop_work(state.head[0], state.agents, state.tasks, number)
    break_off(state.agents[number], state.head[0].hour)


@compiled_in_place
def land(state: MissionArrays, number: int) -> None:
    """End a flight at its goal: the agent works there, or is idle."""
    agent = state.agents[number]
    break_off(agent, state.head[0].hour)
    if agent.order == TO_TASK and state.tasks[agent.order_task].status == OPEN:
        begin_work(state.head[0], state.agents, state.tasks, number, agent.order_task)
    else:
        agent.order = STAY


@inlined
def order(state: MissionArrays, number: int, kind: int, task: int, place: Point) -> bool:
    """Give an agent an order; return whether it is followed, or already in force.

    Parameters
    ----------
    state : MissionArrays
    number : int
        Index of the agent.
    kind : int
        `STAY`, `TO_TASK` or `TO_PLACE`.
    task : int
    place : tuple of float
        Goal of `TO_PLACE`.
    """
    return is_same(state.agents[number], kind, task, place) or follow(state, number, kind, task, place)


@compiled_in_place
def follow(state: MissionArrays, number: int, kind: int, task: int, place: Point) -> bool:
    """Give an agent an order that differs from its last one; return whether it is followed."""
    agent = state.agents[number]
    left = agent.task
    if not obey(state, number, kind, task, place):
        state.head[0].refused += 1
        return False
    agent.order = kind
    if kind == TO_TASK:
        agent.order_task = task
    elif kind == TO_PLACE:
        agent.order_x, agent.order_y, agent.order_z = place
    if agent.flight and agent.arrives <= state.head[0].hour:
        land(state, number)
    note_agent(state, number, left)
    if not state.head[0].is_local:
        tell_all(state, number)
    return True


@compiled_in_place
def is_same(agent: Agent, kind: int, task: int, place: Point) -> bool:
    """Whether an order is the last one of an agent."""
    if agent.order != kind:
        return False
    if kind == TO_TASK:
        return agent.order_task == task
    return kind == STAY or (agent.order_x == place[0] and agent.order_y == place[1] and agent.order_z == place[2])


@compiled_in_place
def obey(state: MissionArrays, number: int, kind: int, task: int, place: Point) -> bool:
    """Let an agent start to follow an order; return whether it can."""
    agent, head = state.agents[number], state.head[0]
    if not IDLE <= agent.status <= WORKING:
        return False
    if kind == STAY:
        count_switch(state, number, NOBODY)
        stand_still(state, number)
        return True
    goal = place
    if kind == TO_TASK:
        to = state.tasks[task]
        if state.task_hour[agent.known, task] < 0 or state.task_left[agent.known, task] < 0 or to.status == TO_COME:
            return False
        if agent.task == task:
            return True
        if not state.allowed[number, task]:
            return False
        goal = (to.x, to.y, to.z)
    here, battery = place_of(agent, head.hour), battery_of(agent, head.hour)
    if not can_fly(head.is_manhattan, agent, here, battery, goal):
        return False
    count_switch(state, number, task if kind == TO_TASK else NOBODY)
    stand_still(state, number)
    depart(head, agent, goal)
    return True


@compiled_in_place
def count_switch(state: MissionArrays, number: int, to: int) -> None:
    """Count an order that sends a flying or working agent elsewhere while its task has work left."""
    agent = state.agents[number]
    left = agent.order_task if agent.status == FLYING and agent.order == TO_TASK else agent.task
    if left in (NOBODY, to) or state.tasks[left].status != OPEN:
        return
    if work_left(state.head[0], state.agents, state.tasks[left], left) > 0:
        state.head[0].switches += 1
