"""Effects of the events of a mission, compiled: see `alloc.problems.missions.simulation.changes`."""

from alloc.allocators.missions.layout import (
    AWAY,
    CANCELLED,
    DONE,
    FAILED,
    IDLE,
    NOBODY,
    OPEN,
    STAY,
    MissionArrays,
)
from alloc.allocators.missions.motion import bring_up_to_date
from alloc.allocators.missions.orders import close, let_decide, note_agent, note_task, stand_still
from alloc.allocators.runtime.compiled import compiled_in_place

JOINS, FAILS, RECALLED, RETURNS, RECHARGES, APPEARS, CANCELS, CHANGES, SILENT = range(9)
"""Kinds of events, in the order of `alloc.problems.missions.events.EventKind`."""


@compiled_in_place
def happen(state: MissionArrays, number: int) -> None:
    """Apply an event now; if its agent has failed or its task is closed, nothing changes."""
    event, head = state.events[number], state.head[0]
    head.is_news = 1
    if event.kind == SILENT:
        state.silences[head.silences] = number
        head.silences += 1
    elif event.agent != NOBODY:
        agent = state.agents[event.agent]
        left = agent.task
        happen_to_agent(state, event.agent, event.kind, event.amount)
        note_agent(state, event.agent, left)
        let_decide(state, event.agent)
    else:
        happen_to_task(state, event.task, event.kind, event.amount)
        note_task(state, event.task)
        worker = state.tasks[event.task].first
        while worker != NOBODY:
            note_agent(state, worker, NOBODY)
            worker = state.agents[worker].next


@compiled_in_place
def happen_to_agent(state: MissionArrays, number: int, kind: int, amount: float) -> None:
    """Let an agent join, fail, be recalled, return or be recharged."""
    agent = state.agents[number]
    if kind in (JOINS, RETURNS):
        agent.status = IDLE
    elif kind == RECHARGES:
        agent.battery += amount
        agent.capacity += amount
    else:
        stand_still(state, number)
        agent.order = STAY
        agent.status = FAILED if kind == FAILS else AWAY
        state.head[0].failed += kind == FAILS


@compiled_in_place
def happen_to_task(state: MissionArrays, number: int, kind: int, workload: float) -> None:
    """Let a task appear, be cancelled, or have more or less work."""
    task = state.tasks[number]
    if kind == APPEARS:
        task.status, task.since = OPEN, state.head[0].hour
        task.appeared = task.left = task.workload
        if task.workload == 0:
            close(state, number, DONE)
    elif task.status == OPEN and kind == CANCELS:
        close(state, number, CANCELLED)
    elif task.status == OPEN:
        bring_up_to_date(state.head[0], state.agents, task, number)
        task.appeared += max(0.0, workload - task.left)
        task.cancelled += max(0.0, task.left - workload)
        task.left = workload
        task.version += 1
        if task.left == 0:
            close(state, number, DONE)
