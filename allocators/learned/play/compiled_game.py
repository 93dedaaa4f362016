"""Whole games in compiled loops: after each round only the pairs are scored anew that its moves touched."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.learned.network.compiled import (
    F,
    Flags,
    Real,
    Small,
    View,
    Weights,
    know_places,
    positive,
    score_agent,
)
from alloc.allocators.runtime.compiled import compiled_loosely
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.game.observation import PAIR_FEATURES, SURPLUS

TIE = 1e-5
"""Relative difference below which two figures in single precision are taken for equal."""

BLOCKED = F(-np.inf)

UNSERVED, SHORTFALL, DISTANCE = range(3)


class Lane(NamedTuple):
    """How far a game has come; all arrays are changed in place.

    Attributes
    ----------
    slot : ndarray, shape (n,)
    left : ndarray of bool, shape (n, c)
    local : ndarray, shape (n, c)
        Local scores, up to date.
    group : ndarray, shape (places,)
    best : ndarray, shape (n,)
        Slots in the best position up to now.
    figures : ndarray, shape (3,)
        Tasks unserved there, shortfall, and mean distance.
    random : ndarray of uint64, shape (1,)
    going : ndarray of bool, shape (1,)
        Whether the game is still on.
    """

    slot: Small
    left: Flags
    local: Real
    group: Real
    best: Small
    figures: NDArray[np.float64]
    random: RandomState
    going: Flags


@compiled_loosely
def gumbel(random: RandomState) -> float:
    """Draw from the standard Gumbel distribution."""
    luck = (F(draw(random, 1 << 24)) + F(0.5)) * F(2.0**-24)
    drawn: float = -np.log(-np.log(luck))
    return drawn


@compiled_loosely
def sum_up(view: View, lane: Lane) -> None:
    """Work the groups out."""
    lane.group[:] = 0
    for agent in range(len(lane.slot)):
        slot = lane.slot[agent]
        lane.group[view.goal[agent, slot]] += view.contribution[agent, slot]


@compiled_loosely
def judge(view: View, lane: Lane, total: bool) -> None:
    """Keep the position if it is the best up to now: fewer unserved, then less shortfall, then nearer.

    The shortfall is that of all tasks together (`total`), or of the worst one.
    """
    need, group = view.need, lane.group
    unserved, short, needed, worst = 0.0, 0.0, 0.0, 0.0
    for j in range(len(need) - 1):
        if need[j] > 0:
            needed += need[j]
            short += positive(need[j] - group[j])
            if group[j] > 0:
                worst = max(worst, 1 - group[j] / need[j])
            else:
                unserved += 1
    shortfall = short / max(needed, 1e-3) if total else max(worst, 0.0)
    distance, crew = 0.0, 0
    for agent in range(len(lane.slot)):
        distance += view.distance[agent, lane.slot[agent]]
        crew += view.ability[agent] > 0
    distance /= max(crew, 1)
    old = lane.figures
    if unserved != old[UNSERVED]:
        better = unserved < old[UNSERVED]
    elif abs(shortfall - old[SHORTFALL]) > TIE:
        better = shortfall < old[SHORTFALL]
    else:
        better = distance < old[DISTANCE] * (1 - TIE)
    if better:
        old[UNSERVED], old[SHORTFALL], old[DISTANCE] = unserved, shortfall, distance
        lane.best[:] = lane.slot


@compiled_loosely
def point(view: View, weights: Weights, token: Real, task: int, agent: int, query: Real) -> None:
    """Fill `query`, shape (width,), with what the agent's group asks for (`ActorCritic.pointer`)."""
    width = len(query)
    last = len(weights.query) - 1
    beyond = view.ability[agent] - F(1)
    for k in range(width):
        query[k] = weights.query[last, k] + beyond * weights.query[width, k]
    for j in range(width):
        factor = token[task, j]
        for k in range(width):
            query[k] += factor * weights.query[j, k]


@compiled_loosely
def compare(query: Real, key: Real, likeness: Real) -> None:
    """Multiply `query`, shape (width,), by `key`, shape (width, places)."""
    likeness[:] = 0
    for d in range(len(query)):
        factor = query[d]
        for j in range(len(likeness)):
            likeness[j] += factor * key[d, j]


@compiled_loosely
def grant_bids(view: View, bids: Real, reserve: float, task: Small, slot: Small, used: Flags, changed: Flags) -> int:
    """Grant the best bids that share no place with a better one, into `slot`; return how many.

    Parameters
    ----------
    bids : ndarray, shape (n, c)
        -inf where none is made.
    used, changed : ndarray of bool, shape (n + places,) and (places,)
        Agents and places that took part; and places whose groups changed. Both are filled.
    """
    n, c = bids.shape
    places = len(changed)
    idle = places - 1
    used[:] = False
    changed[:] = False
    best = np.empty(n, dtype=np.int32)
    for agent in range(n):
        best[agent] = np.argmax(bids[agent])
    granted = 0
    while True:
        top, who = reserve, -1
        for agent in range(n):
            if used[agent] or (task[agent] != idle and used[n + task[agent]]):
                continue
            place = view.goal[agent, best[agent]]
            if place != idle and used[n + place]:
                value, better = BLOCKED, 0
                for k in range(c):
                    place = view.goal[agent, k]
                    if bids[agent, k] > value and not (place != idle and used[n + place]):
                        value, better = bids[agent, k], k
                best[agent] = better
                if value == BLOCKED:
                    used[agent] = True
                    continue
            if bids[agent, best[agent]] > top:
                top, who = bids[agent, best[agent]], agent
        if who < 0:
            return granted
        granted += 1
        place = view.goal[who, best[who]]
        used[who] = True
        for one in (task[who], place):
            changed[one] = True
            if one != idle:
                used[n + one] = True
        slot[who] = best[who]


@compiled_loosely
def begin_game(view: View, weights: Weights, lane: Lane, total: bool) -> None:
    """Score all pairs, and judge the first position; `slot`, `random` and `left` are filled already."""
    n = len(view.legal)
    x = np.empty(PAIR_FEATURES, dtype=np.float32)
    one = np.empty(weights.local2.shape[0] - 1, dtype=np.float32)
    two = np.empty(weights.local3.shape[0] - 1, dtype=np.float32)
    sum_up(view, lane)
    lack = view.need - lane.group
    lack[-1] = -SURPLUS
    for agent in range(n):
        own, wanted = lane.slot[agent], view.legal[agent]
        score_agent(view, weights, lack, agent, own, wanted, x, one, two, lane.local[agent])
    lane.figures[:] = np.inf
    lane.going[0] = True
    judge(view, lane, total)


@compiled_loosely
def play_rounds(view: View, weights: Weights, lane: Lane, rounds: int, temperature: float, total: bool) -> None:
    """Go on with a game for some rounds, unless it ends before."""
    n, c = view.legal.shape
    places, width = len(view.need), weights.key.shape[1]
    x = np.empty(PAIR_FEATURES, dtype=np.float32)
    one = np.empty(weights.local2.shape[0] - 1, dtype=np.float32)
    two = np.empty(weights.local3.shape[0] - 1, dtype=np.float32)
    token = np.empty((places, width), dtype=np.float32)
    key = np.empty((width, places), dtype=np.float32)
    likeness = np.empty(places, dtype=np.float32)
    query = np.empty(width, dtype=np.float32)
    bids = np.empty((n, c), dtype=np.float32)
    task = np.empty(n, dtype=np.int32)
    before = np.empty(n, dtype=np.int32)
    used = np.empty(n + places, dtype=np.bool_)
    changed = np.empty(places, dtype=np.bool_)
    wanted = np.empty(c, dtype=np.bool_)
    scale = F(1) / np.sqrt(F(width))
    cold = F(1) / F(temperature) if temperature > 0 else F(1)
    for _ in range(rounds):
        if not lane.going[0]:
            return
        lack = view.need - lane.group
        lack[-1] = -SURPLUS
        for agent in range(n):
            task[agent] = view.goal[agent, lane.slot[agent]]
        reserve = know_places(view, lane.slot, task, lane.group, lack, x, weights, token, key) * cold
        if temperature > 0:
            reserve += gumbel(lane.random)
        for agent in range(n):
            asked = False
            for k in range(c):
                if not view.legal[agent, k] or lane.left[agent, k] or k == lane.slot[agent]:
                    bids[agent, k] = BLOCKED
                    continue
                if not asked:
                    point(view, weights, token, task[agent], agent, query)
                    compare(query, key, likeness)
                    asked = True
                bid = (lane.local[agent, k] + likeness[view.goal[agent, k]] * scale) * cold
                bids[agent, k] = bid + gumbel(lane.random) if temperature > 0 else bid
        before[:] = lane.slot
        if not grant_bids(view, bids, reserve, task, lane.slot, used, changed):
            lane.going[0] = False
            return
        for agent in range(n):
            if lane.slot[agent] != before[agent]:
                lane.left[agent, before[agent]] = True
        sum_up(view, lane)
        lack = view.need - lane.group
        lack[-1] = -SURPLUS
        changed[places - 1] = False
        for agent in range(n):
            own = lane.slot[agent]
            anew = own != before[agent] or changed[view.goal[agent, own]]
            for k in range(c):
                touched = anew or changed[view.goal[agent, k]]
                wanted[k] = touched and view.legal[agent, k] and not lane.left[agent, k]
            score_agent(view, weights, lack, agent, own, wanted, x, one, two, lane.local[agent])
        judge(view, lane, total)
