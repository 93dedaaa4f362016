"""Flights, work and chance, compiled: `simulation/motion.py`, `simulation/changes.py` and `chance.py`."""

import numpy as np
from numpy.typing import NDArray

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
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import FloatArray

TOLERANCE = 1e-9

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@compiled
def uniform(key: NDArray[np.uint64]) -> float:
    """Return the number in [0, 1) of a key, as `chance.uniform` does."""
    state = _GOLDEN
    for part in key:
        state = (state ^ part) + _GOLDEN
        state = (state ^ (state >> _30)) * _FIRST
        state = (state ^ (state >> _27)) * _SECOND
        state ^= state >> _31
    return float(state >> _11) * 2.0**-53


@compiled
def write(state: State, kind: int, agent: int, task: int) -> None:
    """Log a row, as long as there is space."""
    row = state.counts[LOGGED]
    if row < len(state.log):
        state.log[row, 0], state.log[row, 1], state.log[row, 2], state.log[row, 3] = state.now[0], kind, agent, task
    state.counts[LOGGED] += 1


@compiled
def is_active(state: State, i: int) -> bool:
    """Whether an agent is in the mission."""
    return IDLE <= state.status[i] <= WORKING


@compiled
def share_flown(state: State, i: int) -> float:
    """Return the share of its way that an agent in flight has flown."""
    hours = state.arrives[i] - state.departs[i]
    return 1.0 if hours <= 0 else min(1.0, max(0.0, (state.now[0] - state.departs[i]) / hours))


@compiled
def axis_at(state: State, i: int, axis: int) -> float:
    """Return one coordinate of where an agent is now."""
    if state.status[i] != FLYING:
        return float(state.position[i, axis])
    begin, end = state.source[i, axis], state.goal[i, axis]
    return float(begin + share_flown(state, i) * (end - begin))


@compiled
def battery_at(state: State, setting: Setting, i: int) -> float:
    """Return the battery of an agent now."""
    flown = state.length[i] * share_flown(state, i) if state.status[i] == FLYING else 0.0
    return float(state.battery[i] - setting.rate[i] * flown)


@compiled
def distance_from(state: State, i: int, goal: FloatArray) -> float:
    """Return how far an agent is from a place now."""
    x, y, z = axis_at(state, i, 0) - goal[0], axis_at(state, i, 1) - goal[1], axis_at(state, i, 2) - goal[2]
    return float(np.sqrt(x * x + y * y + z * z))


@compiled
def can_fly(state: State, setting: Setting, i: int, goal: FloatArray) -> bool:
    """Whether a place is within an agent's range and battery."""
    distance = distance_from(state, i, goal)
    if distance > setting.reach[i] + TOLERANCE:
        return False
    return bool(setting.rate[i] * distance <= battery_at(state, setting, i) + TOLERANCE)


@compiled
def update(state: State, setting: Setting, j: int) -> None:
    """Count what was worked, or grew, on a task since it was brought up to date."""
    hours = state.now[0] - state.since[j]
    if state.became[j] == OPEN:
        if state.ability[j] > 0:
            state.left[j] -= min(state.left[j], state.ability[j] * hours)
        elif not state.begun[j]:
            state.left[j] += setting.growth[j] * hours
    state.since[j] = state.now[0]


@compiled
def work_left(state: State, setting: Setting, j: int) -> float:
    """Return the work left of a task now."""
    hours = state.now[0] - state.since[j]
    if state.became[j] == OPEN and state.ability[j] > 0:
        return float(max(0.0, state.left[j] - state.ability[j] * hours))
    if state.became[j] == OPEN and not state.begun[j]:
        return float(state.left[j] + setting.growth[j] * hours)
    return float(state.left[j])


@compiled
def foresee(state: State, setting: Setting, j: int) -> None:
    """Sum up who works at a task that is up to date, and find the hour at which it will be done."""
    ability = 0.0
    for i in range(len(state.works)):
        if state.works[i] == j:
            ability += setting.ability[i]
    state.ability[j] = ability
    state.completes[j] = state.since[j] + state.left[j] / ability if ability > 0 else np.inf


@compiled
def begin_work(state: State, setting: Setting, i: int, j: int) -> None:
    """Let an agent that is at an open task work there."""
    update(state, setting, j)
    state.works[i], state.status[i], state.begun[j] = j, WORKING, True
    foresee(state, setting, j)


@compiled
def land(state: State, setting: Setting, i: int, share: float) -> None:
    """End a flight after a share of the way."""
    for axis in range(3):
        state.position[i, axis] = (
            state.goal[i, axis]
            if share == 1
            else state.source[i, axis] + share * (state.goal[i, axis] - state.source[i, axis])
        )
    flown = share * state.length[i]
    state.distance[i] += flown
    state.energy[i] += setting.rate[i] * flown
    state.battery[i] -= setting.rate[i] * flown
    state.arrives[i], state.status[i] = np.inf, IDLE


@compiled
def stand_still(state: State, setting: Setting, i: int) -> None:
    """Let an agent end its flight or its work where it is."""
    j = state.works[i]
    if j >= 0:
        update(state, setting, j)
        state.works[i], state.status[i] = -1, IDLE
        foresee(state, setting, j)
    if state.status[i] == FLYING:
        land(state, setting, i, share_flown(state, i))


@compiled
def arrive(state: State, setting: Setting, i: int) -> None:
    """End a flight at its goal; the agent works there if a task is open, else it is idle without an order."""
    j = state.flies_to[i]
    land(state, setting, i, 1.0)
    if j >= 0 and state.became[j] == OPEN:
        begin_work(state, setting, i, j)
    else:
        state.order[i] = STAY


@compiled
def close(state: State, setting: Setting, j: int, became: int) -> None:
    """Let a task be done, missed or cancelled now; who worked there is to decide."""
    update(state, setting, j)
    state.became[j], state.left[j], state.closed[j] = became, 0.0, state.now[0]
    state.ability[j], state.completes[j] = 0.0, np.inf
    for i in range(len(state.works)):
        if state.works[i] == j:
            state.works[i], state.status[i], state.order[i], state.deciding[i] = -1, IDLE, STAY, True
    if became == DONE:
        write(state, COMPLETED, -1, j)
    elif became == MISSED:
        write(state, MISSED_IT, -1, j)


@compiled
def count_switch(state: State, setting: Setting, i: int, task: int) -> None:
    """Count an order that sends a flying or working agent elsewhere while its task has work left."""
    j = state.works[i]
    if state.status[i] == FLYING and state.order[i] >= 0:
        j = state.order[i]
    if j >= 0 and j != task and state.became[j] == OPEN and work_left(state, setting, j) > 0:
        state.counts[SWITCHES] += 1


@compiled
def obey(state: State, setting: Setting, i: int, order: int, place: FloatArray) -> bool:
    """Let an agent follow an order, to `place` if it is one to a place; return whether it can."""
    if order == state.order[i] and (order != PLACE or (state.way[i] == place).all()):
        return True
    if order == STAY:
        count_switch(state, setting, i, -1)
        stand_still(state, setting, i)
        state.order[i] = STAY
        write(state, ORDERED, i, STAY)
        return True
    goal = setting.place[order] if order >= 0 else place
    if order >= 0 and not setting.allowed[i, order]:
        return False
    if not can_fly(state, setting, i, goal):
        return False
    count_switch(state, setting, i, order)
    stand_still(state, setting, i)
    state.order[i], state.flies_to[i] = order, max(order, -1)
    for axis in range(3):
        state.source[i, axis], state.goal[i, axis] = state.position[i, axis], goal[axis]
        state.way[i, axis] = place[axis]
    state.length[i] = distance_from(state, i, goal)
    state.departs[i] = state.now[0]
    state.arrives[i] = state.now[0] + state.length[i] / setting.speed[i]
    state.status[i] = FLYING
    write(state, ORDERED, i, order)
    if state.arrives[i] <= state.now[0]:
        arrive(state, setting, i)
        write(state, ARRIVED, i, order)
    return True


@compiled
def leave(state: State, setting: Setting, i: int, failed: bool) -> None:
    """Let an agent fail, or be recalled."""
    stand_still(state, setting, i)
    state.order[i], state.status[i] = STAY, FAILED if failed else AWAY


@compiled
def change(state: State, setting: Setting, j: int, work: float) -> None:
    """Let an open task have other work left from now on."""
    update(state, setting, j)
    state.left[j] = work
    foresee(state, setting, j)
    if work == 0:
        close(state, setting, j, DONE)


@compiled
def cancel(state: State, setting: Setting, j: int) -> None:
    """Let an open task be cancelled."""
    close(state, setting, j, CANCELLED)
