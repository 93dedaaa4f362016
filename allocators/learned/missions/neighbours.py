"""Compiled prediction of the choices of free neighbours: an agent first decides in their place, then for itself.

When a coalition has completed its task, all its agents become free at once with the same knowledge. If each decided
independently, they would make the same choice, and learn of that too late.
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
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.fields import BoolArray, FloatArray, IntArray

Scratch = tuple[Singles, Singles, Singles, Singles, IntArray]
"""Options, token, pooled, scores and choice, as in `Buffers`."""

ORDER = (known.STRENGTH, known.CHARGE, known.OTHER_X, known.OTHER_Y)
"""Figures of agents by which the order of decisions is determined, largest first."""

MAX_PREDICTED = 6
"""Maximum number of neighbours for which an agent decides."""


class PeerView(NamedTuple):
    """Storage for an agent's own situation while it decides in the place of another agent.

    Attributes
    ----------
    own : ndarray, shape (OWN,)
    other : ndarray, shape (OTHER, 2)
        The agent as others see it, and the agent in whose place it decides.
    distance : ndarray, shape (m,)
    can : ndarray of bool, shape (m,)
    waits : ndarray of bool, shape (n,)
        Agents that have not decided yet.
    """

    own: FloatArray
    other: FloatArray
    distance: FloatArray
    can: BoolArray
    waits: BoolArray


def new_peer_view(n: int, m: int) -> PeerView:
    """Return storage for n agents and m tasks."""
    return PeerView(
        np.zeros(known.OWN), np.zeros((known.OTHER, 2)), np.zeros(m), np.zeros(m, np.bool_), np.zeros(n, np.bool_)
    )


@compiled_in_place
def precedes(one: FloatArray, i: int, other: FloatArray, k: int) -> bool:
    """Return whether an agent decides before another: by ability, then battery, then position.

    Thus all agents agree on the order without messages; of two that are equal in all figures, each regards itself as
    first.
    """
    for number in ORDER:
        if one[number, i] != other[number, k]:
            return bool(one[number, i] > other[number, k])
    return False


@compiled_in_place
def predict_neighbours(
    situation: Situation, peer: PeerView, look: FloatArray, buffers: Scratch, weights: MissionWeights
) -> int:
    """Write the predicted choices of free neighbours that decide before an agent without a task; return their number.

    Agents that were free when last heard of have decided since; of those that are free now, the ones that precede the
    agent (`precedes`) decide first.

    Parameters
    ----------
    situation : Situation
    peer : PeerView
    look : ndarray, shape (3,)
        See `fill_options`; the agent's own knowledge of places to explore is used for others as well.
    buffers : Scratch
    weights : MissionWeights
    """
    own, other, waits = situation.own, situation.other, peer.waits
    save_own(situation, peer)
    found = 0
    for i in range(situation.others[0]):
        waits[i] = situation.counts[i] and situation.target[i] == NOBODY and other[known.IS_FREE, i] > 0
        if waits[i] and other[known.HEARD, i] >= own[known.HOUR]:
            waits[i] = precedes(other, i, peer.other, 0)
        found += waits[i]
    decided = min(found, MAX_PREDICTED)
    for _ in range(decided):
        first = -1
        for i in range(situation.others[0]):
            if waits[i] and (first < 0 or precedes(other, i, other, first)):
                first = i
        waits[first] = False
        predict_choice(situation, peer, first, look, buffers, weights)
    if decided:
        restore_own(situation, peer)
    return decided


@inlined
def needs_prediction(own: FloatArray) -> bool:
    """Return whether to predict choices of others; an agent with a task usually keeps it, and needs no predictions."""
    return bool(own[known.METRIC] != known.OTHER_WAYS and own[known.TARGET] < 0)


@compiled_in_place
def save_own(situation: Situation, peer: PeerView) -> None:
    """Store the agent's own situation, and enter the agent as others see it."""
    own, mine = situation.own, peer.other
    for number in range(known.OWN):
        peer.own[number] = own[number]
    for j in range(len(peer.can)):
        peer.distance[j], peer.can[j] = situation.task[known.DISTANCE, j], situation.can[j]
    mine[known.STRENGTH, 0], mine[known.PACE, 0] = own[known.ABILITY], own[known.SPEED]
    mine[known.CHARGE, 0], mine[known.PRICE, 0] = own[known.BATTERY], own[known.ENERGY_PER_DISTANCE]
    mine[known.OTHER_X, 0], mine[known.OTHER_Y, 0], mine[known.OTHER_Z, 0] = own[known.X], own[known.Y], own[known.Z]
    mine[known.HEARD, 0], mine[known.IS_FREE, 0] = own[known.HOUR], 1.0


@compiled_in_place
def restore_own(situation: Situation, peer: PeerView) -> None:
    """Restore the agent's own situation."""
    for number in range(known.OWN):
        situation.own[number] = peer.own[number]
    for j in range(len(peer.can)):
        situation.task[known.DISTANCE, j], situation.can[j] = peer.distance[j], peer.can[j]


@compiled_in_place
def predict_choice(
    situation: Situation, peer: PeerView, i: int, look: FloatArray, buffers: Scratch, weights: MissionWeights
) -> None:
    """Write the predicted choice of a neighbour, in whose place among the others the agent is meanwhile."""
    own, other, task = situation.own, situation.other, situation.task
    options, token, pooled, scores, choice = buffers
    own[known.X], own[known.Y], own[known.Z] = other[known.OTHER_X, i], other[known.OTHER_Y, i], other[known.OTHER_Z, i]
    own[known.ABILITY], own[known.SPEED] = other[known.STRENGTH, i], other[known.PACE, i]
    own[known.BATTERY], own[known.ENERGY_PER_DISTANCE] = other[known.CHARGE, i], other[known.PRICE, i]
    own[known.IS_FLYING] = 0.0
    here = own[known.X], own[known.Y], own[known.Z]
    is_manhattan = own[known.METRIC] == known.MANHATTAN_WAYS
    for j in range(len(peer.can)):
        if peer.can[j]:
            place = task[known.TASK_X, j], task[known.TASK_Y, j], task[known.TASK_Z, j]
            way = distance_between(is_manhattan, here, place)
            task[known.DISTANCE, j] = way
            situation.can[j] = own[known.ENERGY_PER_DISTANCE] * way <= own[known.BATTERY]
    for number in range(known.OTHER):
        peer.other[number, 1] = other[number, i]
        other[number, i] = peer.other[number, 0]
    count = fill_options(situation, look, options, choice)
    score(options, count, weights, token, pooled, scores)
    chosen = choice[np.argmax(scores[:count])]
    for number in range(known.OTHER):
        other[number, i] = peer.other[number, 1]
    situation.target[i] = NOBODY
    if chosen >= 0:
        situation.target[i] = chosen
        other[known.ARRIVES, i] = other[known.HEARD, i] + task[known.DISTANCE, chosen] / other[known.PACE, i]
