"""Flights, work and chance, compiled: `simulation/motion.py`, `simulation/changes.py` and `chance.py`."""

import numpy as np

from alloc.allocators.online.compiled.arrays import (
    ARRIVED,
    AWAY,
    CANCELLED,
    COMPLETED,
    DONE,
    FAILED,
    FLYING,
    IDLE,
    LOGGED,
    MISSED,
    MISSED_IT,
    OPEN,
    ORDERED,
    PLACE,
    STAY,
    SWITCHES,
    WORKING,
    Setting,
    State,
)
from alloc.allocators.runtime.compiled import compiled, inlined
from alloc.problems.fields import FloatArray

TOLERANCE = 1e-9

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@compiled
def mixed(state: np.uint64, part: np.uint64) -> np.uint64:
    """Return the state after one more part of a key, as `chance.uniform` mixes it in."""
    state = (state ^ part) + _GOLDEN
    state = (state ^ (state >> _30)) * _FIRST
    state = (state ^ (state >> _27)) * _SECOND
    return np.uint64(state ^ (state >> _31))


@compiled
def uniform(purpose: int, first: np.uint64, second: np.uint64, one: int, two: int, three: int) -> float:
    """Return the number in [0, 1) of a key, as `chance.uniform` does; parts below 0 are left out."""
    state = mixed(mixed(_GOLDEN, np.uint64(purpose)), first)
    if one >= 0:
        state = mixed(state, second)
        state = mixed(state, np.uint64(one))
    state = mixed(mixed(state, np.uint64(two)), np.uint64(three))
    return float(state >> _11) * 2.0**-53


@inlined
def share_flown(state: State, i: int) -> float:
    """Return the share of its way that an agent in flight has flown."""
    hours = state.agent[i].arrives - state.agent[i].departs
    return 1.0 if hours <= 0 else min(1.0, max(0.0, (state.now[0] - state.agent[i].departs) / hours))


@compiled
def locate(state: State, i: int) -> None:
    """Write where an agent is now."""
    agent = state.agent[i]
    if agent.status == FLYING:
        share = share_flown(state, i)
        for axis in range(3):
            state.here[i, axis] = agent.source[axis] + share * (agent.goal[axis] - agent.source[axis])
    else:
        for axis in range(3):
            state.here[i, axis] = agent.position[axis]


@compiled
def write(state: State, kind: int, agent: int, task: int) -> None:
    """Log a row, as long as there is space."""
    row = state.counts[LOGGED]
    if row < len(state.log):
        state.log[row, 0], state.log[row, 1], state.log[row, 2], state.log[row, 3] = state.now[0], kind, agent, task
    state.counts[LOGGED] += 1


@inlined
def is_active(state: State, i: int) -> bool:
    """Whether an agent is in the mission."""
    return bool(IDLE <= state.agent[i].status <= WORKING)


@compiled
def battery_at(state: State, setting: Setting, i: int) -> float:
    """Return the battery of an agent now."""
    flown = state.agent[i].length * share_flown(state, i) if state.agent[i].status == FLYING else 0.0
    return float(state.agent[i].battery - setting.agent[i].rate * flown)


@compiled
def distance_from(state: State, i: int, goal: FloatArray) -> float:
    """Return how far an agent is from a place now."""
    x, y, z = state.here[i, 0] - goal[0], state.here[i, 1] - goal[1], state.here[i, 2] - goal[2]
    return float(np.sqrt(x * x + y * y + z * z))


@compiled
def can_fly(state: State, setting: Setting, i: int, goal: FloatArray) -> bool:
    """Whether a place is within an agent's range and battery."""
    distance = distance_from(state, i, goal)
    if distance > setting.agent[i].reach + TOLERANCE:
        return False
    return bool(setting.agent[i].rate * distance <= battery_at(state, setting, i) + TOLERANCE)


@compiled
def update(state: State, setting: Setting, j: int) -> None:
    """Count what was worked, or grew, on a task since it was brought up to date."""
    hours = state.now[0] - state.task[j].since
    if state.task[j].became == OPEN:
        if state.task[j].ability > 0:
            state.task[j].left -= min(state.task[j].left, state.task[j].ability * hours)
        elif not state.task[j].begun:
            state.task[j].left += setting.task[j].growth * hours
    state.task[j].since = state.now[0]


@inlined
def work_left(state: State, setting: Setting, j: int) -> float:
    """Return the work left of a task now."""
    hours = state.now[0] - state.task[j].since
    if state.task[j].became == OPEN and state.task[j].ability > 0:
        return float(max(0.0, state.task[j].left - state.task[j].ability * hours))
    if state.task[j].became == OPEN and not state.task[j].begun:
        return float(state.task[j].left + setting.task[j].growth * hours)
    return float(state.task[j].left)


@compiled
def foresee(state: State, setting: Setting, j: int) -> None:
    """Sum up who works at a task that is up to date, and find the hour at which it will be done."""
    ability = 0.0
    for i in range(len(state.agent)):
        if state.agent[i].works == j:
            ability += setting.agent[i].ability
    state.task[j].ability = ability
    state.task[j].completes = state.task[j].since + state.task[j].left / ability if ability > 0 else np.inf


@compiled
def begin_work(state: State, setting: Setting, i: int, j: int) -> None:
    """Let an agent that is at an open task work there."""
    update(state, setting, j)
    state.agent[i].works, state.agent[i].status, state.task[j].begun = j, WORKING, True
    foresee(state, setting, j)


@compiled
def land(state: State, setting: Setting, i: int, share: float) -> None:
    """End a flight after a share of the way."""
    for axis in range(3):
        state.agent[i].position[axis] = (
            state.agent[i].goal[axis]
            if share == 1
            else state.agent[i].source[axis] + share * (state.agent[i].goal[axis] - state.agent[i].source[axis])
        )
    flown = share * state.agent[i].length
    state.agent[i].distance += flown
    state.agent[i].energy += setting.agent[i].rate * flown
    state.agent[i].battery -= setting.agent[i].rate * flown
    state.agent[i].arrives, state.agent[i].status = np.inf, IDLE


@compiled
def stand_still(state: State, setting: Setting, i: int) -> None:
    """Let an agent end its flight or its work where it is."""
    j = state.agent[i].works
    if j >= 0:
        update(state, setting, j)
        state.agent[i].works, state.agent[i].status = -1, IDLE
        foresee(state, setting, j)
    if state.agent[i].status == FLYING:
        land(state, setting, i, share_flown(state, i))


@compiled
def arrive(state: State, setting: Setting, i: int) -> None:
    """End a flight at its goal; the agent works there if a task is open, else it is idle without an order."""
    j = state.agent[i].flies_to
    land(state, setting, i, 1.0)
    if j >= 0 and state.task[j].became == OPEN:
        begin_work(state, setting, i, j)
    else:
        state.agent[i].order = STAY


@compiled
def close(state: State, setting: Setting, j: int, became: int) -> None:
    """Let a task be done, missed or cancelled now; who worked there is to decide."""
    update(state, setting, j)
    state.task[j].became, state.task[j].left, state.task[j].closed = became, 0.0, state.now[0]
    state.task[j].ability, state.task[j].completes = 0.0, np.inf
    for i in range(len(state.agent)):
        if state.agent[i].works == j:
            state.agent[i].works, state.agent[i].status, state.agent[i].order, state.agent[i].deciding = (
                -1,
                IDLE,
                STAY,
                True,
            )
    if became == DONE:
        write(state, COMPLETED, -1, j)
    elif became == MISSED:
        write(state, MISSED_IT, -1, j)


@compiled
def count_switch(state: State, setting: Setting, i: int, task: int) -> None:
    """Count an order that sends a flying or working agent elsewhere while its task has work left."""
    j = state.agent[i].works
    if state.agent[i].status == FLYING and state.agent[i].order >= 0:
        j = state.agent[i].order
    if j >= 0 and j != task and state.task[j].became == OPEN and work_left(state, setting, j) > 0:
        state.counts[SWITCHES] += 1


@compiled
def is_same(one: FloatArray, other: FloatArray) -> bool:
    """Whether two places are the same."""
    return bool(one[0] == other[0] and one[1] == other[1] and one[2] == other[2])


@compiled
def obey(state: State, setting: Setting, i: int, order: int, place: FloatArray) -> bool:
    """Let an agent follow an order, to `place` if it is one to a place; return whether it can."""
    if order == state.agent[i].order and (order != PLACE or is_same(state.agent[i].way, place)):
        return True
    if order == STAY:
        count_switch(state, setting, i, -1)
        stand_still(state, setting, i)
        state.agent[i].order = STAY
        write(state, ORDERED, i, STAY)
        return True
    goal = np.empty(3)
    for axis in range(3):
        goal[axis] = setting.task[order].place[axis] if order >= 0 else place[axis]
    if order >= 0 and not setting.allowed[i, order]:
        return False
    if not can_fly(state, setting, i, goal):
        return False
    count_switch(state, setting, i, order)
    stand_still(state, setting, i)
    state.agent[i].order, state.agent[i].flies_to = order, max(order, -1)
    for axis in range(3):
        state.agent[i].source[axis], state.agent[i].goal[axis] = state.agent[i].position[axis], goal[axis]
        state.agent[i].way[axis] = place[axis]
    state.agent[i].length = distance_from(state, i, goal)
    state.agent[i].departs = state.now[0]
    state.agent[i].arrives = state.now[0] + state.agent[i].length / setting.agent[i].speed
    state.agent[i].status = FLYING
    write(state, ORDERED, i, order)
    if state.agent[i].arrives <= state.now[0]:
        arrive(state, setting, i)
        locate(state, i)
        write(state, ARRIVED, i, order)
    return True


@compiled
def leave(state: State, setting: Setting, i: int, failed: bool) -> None:
    """Let an agent fail, or be recalled."""
    stand_still(state, setting, i)
    state.agent[i].order, state.agent[i].status = STAY, FAILED if failed else AWAY


@compiled
def change(state: State, setting: Setting, j: int, work: float) -> None:
    """Let an open task have other work left from now on."""
    update(state, setting, j)
    state.task[j].left = work
    foresee(state, setting, j)
    if work == 0:
        close(state, setting, j, DONE)


@compiled
def cancel(state: State, setting: Setting, j: int) -> None:
    """Let an open task be cancelled."""
    close(state, setting, j, CANCELLED)
