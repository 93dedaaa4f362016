"""Whole games in compiled loops: after each round only the pairs that its moves touched are scored anew."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.learned.network.compiled_layers import F, Flags, Floats, Ints, positive
from alloc.allocators.learned.network.compiled_places import encode_tasks
from alloc.allocators.learned.network.compiled_scores import PairBuffers, pair_buffers, score_agent
from alloc.allocators.learned.network.game_arrays import GameArrays
from alloc.allocators.learned.network.weights import Weights
from alloc.allocators.learned.play.compiled_bids import grant_bids, gumbel, make_bids
from alloc.allocators.learned.play.rollout import TIE
from alloc.allocators.runtime.compiled import compiled_fast_math
from alloc.allocators.runtime.random import RandomState
from alloc.problems.game.features import IDLE_SURPLUS

UNSERVED, SHORTFALL, DISTANCE = range(3)


class GameState(NamedTuple):
    """How far a game has come; all arrays are changed in place.

    Attributes
    ----------
    slot : ndarray of int, shape (n,)
        Candidate that each agent has chosen.
    visited : ndarray of bool, shape (n, c)
        Candidates that each agent has left in this game.
    local : ndarray, shape (n, c)
        Local scores, up to date.
    group : ndarray, shape (places,)
        Ability at each place.
    best : ndarray of int, shape (n,)
        Slots in the best position up to now.
    figures : ndarray, shape (3,)
        Tasks unserved there, shortfall, and mean distance.
    random : ndarray of uint64, shape (1,)
    running : ndarray of bool, shape (1,)
        Whether the game is still on.
    """

    slot: Ints
    visited: Flags
    local: Floats
    group: Floats
    best: Ints
    figures: NDArray[np.float64]
    random: RandomState
    running: Flags


def new_game(game: GameArrays, best: Ints, figures: NDArray[np.float64], random: RandomState) -> GameState:
    """Return the state of a game that begins at the slots in `best`; the arguments are changed as it is played."""
    return GameState(
        slot=best.copy(),
        visited=np.zeros(game.legal.shape, dtype=np.bool_),
        local=np.zeros(game.legal.shape, dtype=np.float32),
        group=np.zeros(len(game.need), dtype=np.float32),
        best=best,
        figures=figures,
        random=random,
        running=np.zeros(1, dtype=np.bool_),
    )


@compiled_fast_math
def reset_game(game: GameArrays, weights: Weights, state: GameState, total: bool) -> None:
    """Score all pairs, and rate the first position; `slot`, `random` and `visited` are filled already."""
    buffers = pair_buffers(game, weights)
    shortfall = update_groups(game, state)
    for agent in range(len(game.legal)):
        score_agent(game, weights, shortfall, agent, state.slot[agent], game.legal[agent], buffers, state.local[agent])
    state.figures[:] = np.inf
    state.running[0] = True
    keep_if_best(game, state, total)


@compiled_fast_math
def play_rounds(
    game: GameArrays, weights: Weights, state: GameState, rounds: int, temperature: float, total: bool
) -> None:
    """Go on with a game for some rounds, unless it ends before."""
    n, c = game.legal.shape
    places, width = len(game.need), weights.key.shape[1]
    buffers = pair_buffers(game, weights)
    token = np.empty((places, width), dtype=np.float32)
    key = np.empty((width, places), dtype=np.float32)
    bids = np.empty((n, c), dtype=np.float32)
    task = np.empty(n, dtype=np.int32)
    used = np.empty(n + places, dtype=np.bool_)
    changed = np.empty(places, dtype=np.bool_)
    noisy = temperature > 0
    inverse = F(1) / F(temperature) if noisy else F(1)
    shortfall = update_groups(game, state)
    for _ in range(rounds):
        if not state.running[0]:
            return
        for agent in range(n):
            task[agent] = game.candidates[agent, state.slot[agent]]
        reserve = encode_tasks(game, state.slot, task, state.group, shortfall, weights, token, key) * inverse
        if noisy:
            reserve += gumbel(state.random)
        make_bids(
            game, weights, state.slot, state.visited, state.local, task, token, key, inverse, noisy, state.random, bids
        )
        before = state.slot.copy()
        if not grant_bids(game, bids, reserve, task, state.slot, used, changed):
            state.running[0] = False
            return
        shortfall = update_groups(game, state)
        score_changes(game, weights, state, before, changed, shortfall, buffers)
        keep_if_best(game, state, total)


@compiled_fast_math
def update_groups(game: GameArrays, state: GameState) -> Floats:
    """Add the contributions up by place; return the shortfall of each place, shape (places,)."""
    state.group[:] = 0
    for agent in range(len(state.slot)):
        slot = state.slot[agent]
        state.group[game.candidates[agent, slot]] += game.contribution[agent, slot]
    shortfall = game.need - state.group
    shortfall[-1] = -IDLE_SURPLUS
    return shortfall


@compiled_fast_math
def score_changes(
    game: GameArrays,
    weights: Weights,
    state: GameState,
    before: Ints,
    changed: Flags,
    shortfall: Floats,
    buffers: PairBuffers,
) -> None:
    """Note which candidates were left, and score the pairs anew whose agent or candidate is at a changed place.

    Parameters
    ----------
    before : ndarray of int, shape (n,)
        Slots before the moves.
    changed : ndarray of bool, shape (places,)
        Places whose groups changed.
    """
    n, c = game.legal.shape
    wanted = np.empty(c, dtype=np.bool_)
    changed[-1] = False
    for agent in range(n):
        own = state.slot[agent]
        has_moved = own != before[agent]
        if has_moved:
            state.visited[agent, before[agent]] = True
        concerned = has_moved or changed[game.candidates[agent, own]]
        count = 0
        for k in range(c):
            touched = concerned or changed[game.candidates[agent, k]]
            wanted[k] = touched and game.legal[agent, k] and not state.visited[agent, k]
            count += wanted[k]
        if count:
            score_agent(game, weights, shortfall, agent, own, wanted, buffers, state.local[agent])


@compiled_fast_math
def keep_if_best(game: GameArrays, state: GameState, total: bool) -> None:
    """Keep the position if it is the best up to now: fewer unserved, then less shortfall, then nearer.

    The shortfall is that of all tasks together (`total`), or of the worst one.
    """
    unserved, shortfall = unserved_and_shortfall(game, state, total)
    distance, agents = 0.0, 0
    for agent in range(len(state.slot)):
        distance += game.distance[agent, state.slot[agent]]
        agents += game.ability[agent] > 0
    distance /= max(agents, 1)
    best = state.figures
    if unserved != best[UNSERVED]:
        better = unserved < best[UNSERVED]
    elif abs(shortfall - best[SHORTFALL]) > TIE:
        better = shortfall < best[SHORTFALL]
    else:
        better = distance < best[DISTANCE] * (1 - TIE)
    if better:
        best[UNSERVED], best[SHORTFALL], best[DISTANCE] = unserved, shortfall, distance
        state.best[:] = state.slot


@compiled_fast_math
def unserved_and_shortfall(game: GameArrays, state: GameState, total: bool) -> tuple[float, float]:
    """Return the number of tasks without anyone, and the relative shortfall in total or of the worst task."""
    need, group = game.need, state.group
    unserved, short, needed, worst = 0.0, 0.0, 0.0, 0.0
    for j in range(len(need) - 1):
        if need[j] > 0:
            needed += need[j]
            short += positive(need[j] - group[j])
            if group[j] > 0:
                worst = max(worst, 1 - group[j] / need[j])
            else:
                unserved += 1
    return unserved, short / max(needed, 1e-3) if total else max(worst, 0.0)
