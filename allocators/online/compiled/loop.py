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
from alloc.allocators.online.compiled.motion import (
    arrive,
    cancel,
    change,
    close,
    is_active,
    land,
    leave,
    locate,
    update,
    write,
)
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
        for i in range(len(state.agent)):
            state.agent[i].looked = False
        event, is_news = happen(state, setting, event)
        for i in range(len(state.agent)):
            locate(state, i)
        if setting.is_local and hour == state.counts[TICK] * setting.limits[3]:
            for i in range(len(state.agent)):
                if is_active(state, i):
                    look_around(state, setting, i)
                    state.agent[i].looked, state.agent[i].deciding = True, True
            talk(state, setting)
        give_orders(state, setting, is_news, policy, weights)
    finish(state, setting)
    return is_over(state)


@compiled
def next_hour(state: State, setting: Setting, event: int) -> float:
    """Return the hour of what comes next."""
    hour = np.inf
    for j in range(len(state.task)):
        if state.task[j].became == OPEN:
            hour = min(hour, max(state.task[j].completes, state.now[0]))
        if state.task[j].became <= OPEN:
            hour = min(hour, setting.task[j].deadline)
    for i in range(len(state.agent)):
        if state.agent[i].status == FLYING:
            hour = min(hour, state.agent[i].arrives)
    if event < len(setting.event):
        hour = min(hour, setting.event[event].hour)
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
        if event < len(setting.event) and setting.event[event].hour == hour:
            apply(state, setting, event)
            event, is_news = event + 1, True
            continue
        i = first_arrival(state)
        if i < 0:
            return event, is_news
        j = state.agent[i].flies_to
        arrive(state, setting, i)
        write(state, ARRIVED, i, j)
        if state.agent[i].status == IDLE:
            state.agent[i].deciding, is_news = True, True


@compiled
def complete(state: State, setting: Setting) -> bool:
    """Let one task be done whose work ends now; return whether there was one."""
    for j in range(len(state.task)):
        if state.task[j].became == OPEN and state.task[j].completes <= state.now[0]:
            close(state, setting, j, DONE)
            return True
    return False


@compiled
def pass_deadlines(state: State, setting: Setting) -> bool:
    """Let one task be missed, or just done, whose deadline is now; return whether there was one."""
    for j in range(len(state.task)):
        if state.task[j].became == OPEN and setting.task[j].deadline <= state.now[0]:
            update(state, setting, j)
            is_done = state.task[j].left <= CLOSE * setting.task[j].workload
            close(state, setting, j, DONE if is_done else MISSED)
            return True
    return False


@compiled
def first_arrival(state: State) -> int:
    """Return an agent whose flight ends now, -1 for none."""
    for i in range(len(state.agent)):
        if state.agent[i].status == FLYING and state.agent[i].arrives <= state.now[0]:
            return i
    return -1


@compiled
def apply(state: State, setting: Setting, event: int) -> None:
    """Let an event of the mission happen."""
    kind, subject, amount = setting.event[event].kind, setting.event[event].subject, setting.event[event].amount
    if kind == APPEARS:
        state.task[subject].became, state.task[subject].since = OPEN, state.now[0]
        state.task[subject].left = setting.task[subject].workload
        if setting.task[subject].workload == 0:
            close(state, setting, subject, DONE)
    elif kind < APPEARS:
        state.agent[subject].deciding = True
        if kind in (JOINS, RETURNS):
            state.agent[subject].status = IDLE
        elif kind == RECHARGES:
            state.agent[subject].battery += amount
        elif kind in (FAILS, RECALLED):
            leave(state, setting, subject, kind == FAILS)
    elif state.task[subject].became == OPEN:
        if kind == CANCELS:
            cancel(state, setting, subject)
        else:
            change(state, setting, subject, amount)


@compiled
def give_orders(state: State, setting: Setting, is_news: bool, policy: int, weights: FloatArray) -> None:
    """Let all agents decide whose turn it is."""
    n = len(state.agent)
    if is_over(state):
        return
    for i in range(n):
        turn = state.agent[i].deciding if setting.is_local else is_news
        state.agent[i].deciding = turn and is_active(state, i)
        if state.agent[i].deciding and not state.agent[i].looked:
            look_around(state, setting, i)
    for i in range(n):
        if state.agent[i].deciding:
            state.agent[i].deciding = False
            report_agent(state, i, i)
            decide(state, setting, i, policy, weights)
            if not setting.is_local:
                for k in range(n):
                    report_agent(state, k, i)


@compiled
def is_over(state: State) -> bool:
    """Whether no task is open or to come, or nobody is left to do one."""
    is_left = False
    for j in range(len(state.task)):
        if state.task[j].became == OPEN or state.task[j].became == TO_COME:
            is_left = True
    if not is_left:
        return True
    is_anybody = False
    for i in range(len(state.agent)):
        if state.agent[i].status != FAILED:
            is_anybody = True
    return not is_anybody


@compiled
def finish(state: State, setting: Setting) -> None:
    """Bring all tasks up to date, and let flights end at their goals."""
    for j in range(len(state.task)):
        update(state, setting, j)
    for i in range(len(state.agent)):
        if state.agent[i].status == FLYING:
            land(state, setting, i, 1.0)
