"""From event to event, compiled: `simulation/simulation.py`."""

import numpy as np

from alloc.allocators.online.compiled.arrays import (
    APPEARS,
    ARRIVED,
    CANCELS,
    DONE,
    FAILED,
    FAILS,
    FLYING,
    IDLE,
    JOINS,
    MISSED,
    OPEN,
    RECALLED,
    RECHARGES,
    RETURNS,
    TICK,
    TO_COME,
    Setting,
    State,
)
from alloc.allocators.online.compiled.knowledge import look_around, report_agent, talk
from alloc.allocators.online.compiled.motion import arrive, cancel, change, close, is_active, land, leave, update, write
from alloc.allocators.online.compiled.policies import decide
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import FloatArray

CLOSE = 1e-9


@compiled
def run_mission(state: State, setting: Setting, policy: int, weights: FloatArray) -> bool:
    """Let a mission go on to its end; return whether its last hour is that of its last event."""
    event = 0
    while not is_over(state):
        hour = next_hour(state, setting, event)
        if hour > setting.limits[0]:
            if hour < np.inf:
                state.now[0] = setting.limits[0]
            break
        state.now[0] = hour
        state.looked[:] = False
        event, is_news = happen(state, setting, event)
        if setting.is_local and hour == state.counts[TICK] * setting.limits[3]:
            for i in range(len(state.status)):
                if is_active(state, i):
                    look_around(state, setting, i)
                    state.looked[i], state.deciding[i] = True, True
            talk(state, setting)
        give_orders(state, setting, is_news, policy, weights)
    finish(state, setting)
    return is_over(state)


@compiled
def next_hour(state: State, setting: Setting, event: int) -> float:
    """Return the hour of what comes next."""
    hour = np.inf
    for j in range(len(state.became)):
        if state.became[j] == OPEN:
            hour = min(hour, max(state.completes[j], state.now[0]))
        if state.became[j] <= OPEN:
            hour = min(hour, setting.deadline[j])
    for i in range(len(state.status)):
        if state.status[i] == FLYING:
            hour = min(hour, state.arrives[i])
    if event < len(setting.hour):
        hour = min(hour, setting.hour[event])
    if setting.is_local:
        hour = min(hour, state.counts[TICK] * setting.limits[3])
    return float(hour)


@compiled
def happen(state: State, setting: Setting, event: int) -> tuple[int, bool]:
    """Let all of this hour happen in its order; return the next event, and whether anything did."""
    hour, is_news = state.now[0], False
    while True:
        if complete(state, setting):
            is_news = True
            continue
        if pass_deadlines(state, setting):
            is_news = True
            continue
        if event < len(setting.hour) and setting.hour[event] == hour:
            apply(state, setting, event)
            event, is_news = event + 1, True
            continue
        i = first_arrival(state)
        if i < 0:
            return event, is_news
        j = state.flies_to[i]
        arrive(state, setting, i)
        write(state, ARRIVED, i, j)
        if state.status[i] == IDLE:
            state.deciding[i], is_news = True, True


@compiled
def complete(state: State, setting: Setting) -> bool:
    """Let one task be done whose work ends now; return whether there was one."""
    for j in range(len(state.became)):
        if state.became[j] == OPEN and state.completes[j] <= state.now[0]:
            close(state, setting, j, DONE)
            return True
    return False


@compiled
def pass_deadlines(state: State, setting: Setting) -> bool:
    """Let one task be missed, or just done, whose deadline is now; return whether there was one."""
    for j in range(len(state.became)):
        if state.became[j] == OPEN and setting.deadline[j] <= state.now[0]:
            update(state, setting, j)
            is_done = state.left[j] <= CLOSE * setting.workload[j]
            close(state, setting, j, DONE if is_done else MISSED)
            return True
    return False


@compiled
def first_arrival(state: State) -> int:
    """Return an agent whose flight ends now, -1 for none."""
    for i in range(len(state.status)):
        if state.status[i] == FLYING and state.arrives[i] <= state.now[0]:
            return i
    return -1


@compiled
def apply(state: State, setting: Setting, event: int) -> None:
    """Let an event of the mission happen."""
    kind, subject, amount = setting.kind[event], setting.subject[event], setting.amount[event]
    if kind == APPEARS:
        state.became[subject], state.since[subject] = OPEN, state.now[0]
        state.left[subject] = setting.workload[subject]
        if setting.workload[subject] == 0:
            close(state, setting, subject, DONE)
    elif kind < APPEARS:
        state.deciding[subject] = True
        if kind in (JOINS, RETURNS):
            state.status[subject] = IDLE
        elif kind == RECHARGES:
            state.battery[subject] += amount
        elif kind in (FAILS, RECALLED):
            leave(state, setting, subject, kind == FAILS)
    elif state.became[subject] == OPEN:
        if kind == CANCELS:
            cancel(state, setting, subject)
        else:
            change(state, setting, subject, amount)


@compiled
def give_orders(state: State, setting: Setting, is_news: bool, policy: int, weights: FloatArray) -> None:
    """Let all agents decide whose turn it is."""
    n = len(state.status)
    if is_over(state):
        return
    for i in range(n):
        turn = state.deciding[i] if setting.is_local else is_news
        state.deciding[i] = turn and is_active(state, i)
        if state.deciding[i] and not state.looked[i]:
            look_around(state, setting, i)
    for i in range(n):
        if state.deciding[i]:
            state.deciding[i] = False
            report_agent(state, i, i)
            decide(state, setting, i, policy, weights)
            if not setting.is_local:
                for k in range(n):
                    report_agent(state, k, i)


@compiled
def is_over(state: State) -> bool:
    """Whether no task is open or to come, or nobody is left to do one."""
    is_left = False
    for j in range(len(state.became)):
        if state.became[j] == OPEN or state.became[j] == TO_COME:
            is_left = True
    if not is_left:
        return True
    for i in range(len(state.status)):
        if state.status[i] != FAILED:
            return False
    return True


@compiled
def finish(state: State, setting: Setting) -> None:
    """Bring all tasks up to date, and let flights end at their goals."""
    for j in range(len(state.became)):
        update(state, setting, j)
    for i in range(len(state.status)):
        if state.status[i] == FLYING:
            land(state, setting, i, 1.0)
