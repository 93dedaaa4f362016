"""What free neighbours will choose: an agent decides for them as if in their place, and then for itself; compiled.

When a coalition has done its task, all its agents are free at once and know the same. If each decided by itself they
would choose alike, and learn of that too late.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.forward import score
from alloc.allocators.learned.missions.network_arrays import MissionWeights, Singles
from alloc.allocators.learned.missions.options import fill_options
from alloc.allocators.learned.missions.situation import Situation
from alloc.allocators.missions.layout import NOBODY
from alloc.allocators.missions.motion import distance_between
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import BoolArray, FloatArray, IntArray

Scratch = tuple[Singles, Singles, Singles, Singles, IntArray]
"""Options, token, pooled, scores and choice, as in `Room`."""

ORDER = (known.STRENGTH, known.CHARGE, known.OTHER_X, known.OTHER_Y)
"""What decides who is first, the largest number first."""

MOST = 6
"""Neighbours for whom an agent decides at the most."""


class Swap(NamedTuple):
    """Room for what is so of an agent itself while it decides in the place of another.

    Attributes
    ----------
    own : ndarray, shape (OWN,)
    other : ndarray, shape (OTHER, 2)
        The agent as others see it, and the other in whose place it decides.
    distance : ndarray, shape (m,)
    can : ndarray of bool, shape (m,)
    waits : ndarray of bool, shape (n,)
        Who is still to decide.
    """

    own: FloatArray
    other: FloatArray
    distance: FloatArray
    can: BoolArray
    waits: BoolArray


def swap_for(n: int, m: int) -> Swap:
    """Return room for n agents and m tasks."""
    return Swap(
        np.zeros(known.OWN), np.zeros((known.OTHER, 2)), np.zeros(m), np.zeros(m, np.bool_), np.zeros(n, np.bool_)
    )


@compiled_in_place
def precedes(one: FloatArray, i: int, other: FloatArray, k: int) -> bool:
    """Return whether an agent decides before another: the stronger, then that of more battery, then by place.

    So all agree on the order without a message; of two that are equal in all of that, each takes itself for the first.
    """
    for number in ORDER:
        if one[number, i] != other[number, k]:
            return bool(one[number, i] > other[number, k])
    return False


@compiled_in_place
def foresee(situation: Situation, swap: Swap, look: FloatArray, room: Scratch, weights: MissionWeights) -> int:
    """Fill in what free neighbours will choose that decide before an agent without a task; return how many they are.

    Those that were free when the agent last heard of them have decided since; of those that are free now, the ones
    that come before it by `precedes` decide first. An agent that has a task keeps to it as a rule, and does without.

    Parameters
    ----------
    situation : Situation
    swap : Swap
    look : ndarray, shape (3,)
        See `fill_options`; what the agent knows of places to look around counts for others as well.
    room : Scratch
    weights : MissionWeights
    """
    own, other, waits = situation.own, situation.other, swap.waits
    if own[known.METRIC] == known.OTHER_WAYS or own[known.TARGET] >= 0:
        return 0
    step_out(situation, swap)
    found = 0
    for i in range(situation.others[0]):
        waits[i] = situation.counts[i] and situation.target[i] == NOBODY and other[known.IS_FREE, i] > 0
        if waits[i] and other[known.HEARD, i] >= own[known.HOUR]:
            waits[i] = precedes(other, i, swap.other, 0)
        found += waits[i]
    decided = min(found, MOST)
    for _ in range(decided):
        first = -1
        for i in range(situation.others[0]):
            if waits[i] and (first < 0 or precedes(other, i, other, first)):
                first = i
        waits[first] = False
        decide_for(situation, swap, first, look, room, weights)
    if decided:
        step_in(situation, swap)
    return decided


@compiled_in_place
def step_out(situation: Situation, swap: Swap) -> None:
    """Keep what is so of the agent itself, and note it as others see it."""
    own, mine = situation.own, swap.other
    for number in range(known.OWN):
        swap.own[number] = own[number]
    for j in range(len(swap.can)):
        swap.distance[j], swap.can[j] = situation.task[known.DISTANCE, j], situation.can[j]
    mine[known.STRENGTH, 0], mine[known.PACE, 0] = own[known.ABILITY], own[known.SPEED]
    mine[known.CHARGE, 0], mine[known.PRICE, 0] = own[known.BATTERY], own[known.ENERGY_PER_DISTANCE]
    mine[known.OTHER_X, 0], mine[known.OTHER_Y, 0], mine[known.OTHER_Z, 0] = own[known.X], own[known.Y], own[known.Z]
    mine[known.HEARD, 0], mine[known.IS_FREE, 0] = own[known.HOUR], 1.0


@compiled_in_place
def step_in(situation: Situation, swap: Swap) -> None:
    """Restore what is so of the agent itself."""
    for number in range(known.OWN):
        situation.own[number] = swap.own[number]
    for j in range(len(swap.can)):
        situation.task[known.DISTANCE, j], situation.can[j] = swap.distance[j], swap.can[j]


@compiled_in_place
def decide_for(
    situation: Situation, swap: Swap, i: int, look: FloatArray, room: Scratch, weights: MissionWeights
) -> None:
    """Fill in what a neighbour will choose; the agent has its place among others meanwhile."""
    own, other, task = situation.own, situation.other, situation.task
    options, token, pooled, scores, choice = room
    own[known.X], own[known.Y], own[known.Z] = other[known.OTHER_X, i], other[known.OTHER_Y, i], other[known.OTHER_Z, i]
    own[known.ABILITY], own[known.SPEED] = other[known.STRENGTH, i], other[known.PACE, i]
    own[known.BATTERY], own[known.ENERGY_PER_DISTANCE] = other[known.CHARGE, i], other[known.PRICE, i]
    own[known.IS_FLYING] = 0.0
    here = own[known.X], own[known.Y], own[known.Z]
    is_manhattan = own[known.METRIC] == known.MANHATTAN_WAYS
    for j in range(len(swap.can)):
        if swap.can[j]:
            place = task[known.TASK_X, j], task[known.TASK_Y, j], task[known.TASK_Z, j]
            way = distance_between(is_manhattan, here, place)
            task[known.DISTANCE, j] = way
            situation.can[j] = own[known.ENERGY_PER_DISTANCE] * way <= own[known.BATTERY]
    for number in range(known.OTHER):
        swap.other[number, 1] = other[number, i]
        other[number, i] = swap.other[number, 0]
    count = fill_options(situation, look, options, choice)
    score(options, count, weights, token, pooled, scores)
    chosen = choice[np.argmax(scores[:count])]
    for number in range(known.OTHER):
        other[number, i] = swap.other[number, 1]
    situation.target[i] = NOBODY
    if chosen >= 0:
        situation.target[i] = chosen
        other[known.ARRIVES, i] = other[known.HEARD, i] + task[known.DISTANCE, chosen] / other[known.PACE, i]
