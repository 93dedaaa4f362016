"""Policies that decide in compiled loops: `policies/simple.py` and `policies/exploring.py`."""

import numpy as np

from alloc.allocators.online.compiled.arrays import FLYING, OPEN, PLACE, STAY, Setting, State
from alloc.allocators.online.compiled.motion import battery_at, can_fly, distance_from, obey, uniform
from alloc.allocators.online.policies.exploring import BATTERY_SHARE, TRIES
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import FloatArray
from alloc.problems.missions.chance import EXPLORING

NEAREST = 0
"""The policies there are."""


@compiled
def decide(state: State, setting: Setting, i: int, policy: int, weights: FloatArray) -> None:
    """Give an agent the order of a policy; `weights` are for those that have some."""
    j = state.agent[i].order
    if j >= 0 and state.seen[0, i, j] >= 0 and state.seen[2, i, j] == OPEN:
        return
    best, least = -1, np.inf
    for j in range(len(state.task)):
        if state.seen[0, i, j] >= 0 and state.seen[2, i, j] == OPEN and setting.allowed[i, j]:
            distance = distance_from(state, i, setting.task[j].place)
            if distance < least and can_fly(state, setting, i, setting.task[j].place):
                best, least = j, distance
    if best >= 0:
        obey(state, setting, i, best, state.agent[i].way)
    else:
        explore(state, setting, i)


@compiled
def explore(state: State, setting: Setting, i: int) -> None:
    """Send an agent that knows of nothing to do to a random place in the area."""
    if not (setting.is_local and setting.limits[1] < np.inf):
        obey(state, setting, i, STAY, state.agent[i].way)
        return
    if state.agent[i].status == FLYING and state.agent[i].order < 0:
        return
    place, battery = np.empty(3), battery_at(state, setting, i)
    for _ in range(TRIES):
        for axis in range(3):
            state.agent[i].drawn += 1
            drawn = uniform(EXPLORING, setting.seeds[1], setting.seeds[1], -1, i + 1, state.agent[i].drawn)
            low = setting.area[0, axis]
            place[axis] = low + (setting.area[1, axis] - low) * drawn
        is_cheap = setting.agent[i].rate * distance_from(state, i, place) <= BATTERY_SHARE * battery
        if is_cheap and can_fly(state, setting, i, place):
            obey(state, setting, i, PLACE, place)
            return
    obey(state, setting, i, STAY, state.agent[i].way)
