"""Bids in compiled loops: the pointer's part of the scores, noise, and which bids are granted."""

import numpy as np

from alloc.allocators.learned.network.compiled_layers import F, Flags, Floats, Ints
from alloc.allocators.learned.network.game_arrays import GameArrays
from alloc.allocators.learned.network.weights import Weights
from alloc.allocators.runtime.compiled import compiled_fast_math
from alloc.allocators.runtime.random import RandomState, draw

MASKED = F(-np.inf)
"""Score of a bid that is not made."""


@compiled_fast_math
def gumbel(random: RandomState) -> float:
    """Draw from the standard Gumbel distribution."""
    uniform = (F(draw(random, 1 << 24)) + F(0.5)) * F(2.0**-24)
    drawn: float = -np.log(-np.log(uniform))
    return drawn


@compiled_fast_math
def fill_query(game: GameArrays, weights: Weights, token: Floats, task: int, agent: int, query: Floats) -> None:
    """Fill `query`, shape (width,), with that of the agent's group (`ActorCritic.pointer`)."""
    width = len(query)
    last = len(weights.query) - 1
    relative = game.ability[agent] - F(1)
    for k in range(width):
        query[k] = weights.query[last, k] + relative * weights.query[width, k]
    for j in range(width):
        factor = token[task, j]
        for k in range(width):
            query[k] += factor * weights.query[j, k]


@compiled_fast_math
def fill_likeness(query: Floats, key: Floats, likeness: Floats) -> None:
    """Fill `likeness`, shape (places,), with `query`, shape (width,), times `key`, shape (width, places)."""
    likeness[:] = 0
    for d in range(len(query)):
        factor = query[d]
        for j in range(len(likeness)):
            likeness[j] += factor * key[d, j]


@compiled_fast_math
def make_bids(
    game: GameArrays,
    weights: Weights,
    slot: Ints,
    visited: Flags,
    local: Floats,
    task: Ints,
    token: Floats,
    key: Floats,
    inverse_temperature: float,
    noisy: bool,
    random: RandomState,
    bids: Floats,
) -> None:
    """Fill the bids of all agents, shape (n, c): scores over the temperature, with Gumbel noise if wanted.

    Parameters
    ----------
    slot, task : ndarray of int, shape (n,)
        Candidate and place of each agent.
    visited : ndarray of bool, shape (n, c)
    local : ndarray, shape (n, c)
        Local part of the scores.
    token, key : ndarray, shape (places, width) and (width, places)
        As `encode_tasks` fills them.
    """
    n, c = bids.shape
    query = np.empty(token.shape[1], dtype=np.float32)
    likeness = np.empty(len(token), dtype=np.float32)
    scale = F(1) / np.sqrt(F(token.shape[1]))
    for agent in range(n):
        compared = False
        for k in range(c):
            if not game.legal[agent, k] or visited[agent, k] or k == slot[agent]:
                bids[agent, k] = MASKED
                continue
            if not compared:
                fill_query(game, weights, token, task[agent], agent, query)
                fill_likeness(query, key, likeness)
                compared = True
            bid = (local[agent, k] + likeness[game.candidates[agent, k]] * scale) * inverse_temperature
            bids[agent, k] = bid + gumbel(random) if noisy else bid


@compiled_fast_math
def grant_bids(
    game: GameArrays, bids: Floats, reserve: float, task: Ints, slot: Ints, used: Flags, changed: Flags
) -> int:
    """Grant the best bids that share no place with a better one, into `slot`; return how many.

    Parameters
    ----------
    bids : ndarray, shape (n, c)
        `MASKED` where none is made.
    reserve : float
        Bids below it are not granted.
    task, slot : ndarray of int, shape (n,)
        Place and candidate of each agent.
    used, changed : ndarray of bool, shape (n + places,) and (places,)
        Agents and places that took part; and places whose groups changed. Both are filled.
    """
    n = len(bids)
    idle = len(changed) - 1
    used[:] = False
    changed[:] = False
    best = np.empty(n, dtype=np.int32)
    for agent in range(n):
        best[agent] = np.argmax(bids[agent])
    granted = 0
    while True:
        highest, winner = reserve, -1
        for agent in range(n):
            if used[agent] or (task[agent] != idle and used[n + task[agent]]):
                continue
            place = game.candidates[agent, best[agent]]
            if place != idle and used[n + place] and not find_next_best(game, bids, agent, used, idle, best):
                used[agent] = True
                continue
            if bids[agent, best[agent]] > highest:
                highest, winner = bids[agent, best[agent]], agent
        if winner < 0:
            return granted
        granted += 1
        used[winner] = True
        for place in (task[winner], game.candidates[winner, best[winner]]):
            changed[place] = True
            if place != idle:
                used[n + place] = True
        slot[winner] = best[winner]


@compiled_fast_math
def find_next_best(game: GameArrays, bids: Floats, agent: int, used: Flags, idle: int, best: Ints) -> bool:
    """Put the agent's best bid for a place that is not used into `best`; return whether there is any."""
    n, c = bids.shape
    value, better = MASKED, 0
    for k in range(c):
        place = game.candidates[agent, k]
        if bids[agent, k] > value and not (place != idle and used[n + place]):
            value, better = bids[agent, k], k
    best[agent] = better
    return value != MASKED
