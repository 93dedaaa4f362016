"""The attention of `ActorCritic` over agents and places in compiled loops.

The features are those of `problems.game.observation` in single precision; `compiled_scores` says why their formulas
stand twice.
"""

import numpy as np

from alloc.allocators.learned.network.compiled_layers import F, Floats, Ints, clip, clip_to_one, linear, positive
from alloc.allocators.learned.network.game_arrays import GameArrays
from alloc.allocators.learned.network.weights import Weights
from alloc.allocators.runtime.compiled import compiled_fast_math, inlined
from alloc.problems.game.board import SMALLEST
from alloc.problems.game.features import (
    AGENT_FEATURES,
    FINE_FACTOR,
    LOG_NEED_OFFSET,
    SHORTFALL_DIVISOR,
    TASK_FEATURES,
    AgentFeature,
    TaskFeature,
)


@compiled_fast_math
def encode_tasks(
    game: GameArrays,
    slot: Ints,
    task: Ints,
    group: Floats,
    shortfall: Floats,
    weights: Weights,
    token: Floats,
    key: Floats,
) -> float:
    """Encode all places (`ActorCritic.places`), and return the reserve.

    Parameters
    ----------
    slot, task : ndarray of int, shape (n,)
        Candidate and place of each agent.
    group, shortfall : ndarray, shape (m + 1,)
        Ability at each place, and what it is short of.
    token : ndarray, shape (m + 1, width)
        Filled with the encodings.
    key : ndarray, shape (width, m + 1)
        Filled with the keys that the pointer compares with.
    """
    places, width = token.shape
    embed_tasks(game, task, group, shortfall, weights, token)
    if len(weights.member):
        attend_to_members(game, slot, task, shortfall, weights, token)
        attend_to_neighbours(game, weights, token)
    mix_and_normalise(weights, token)
    out = np.empty(width, dtype=np.float32)
    pooled = np.zeros(2 * width, dtype=np.float32)
    pooled[width:] = -np.inf
    for j in range(places):
        for k in range(width):
            pooled[k] += token[j, k] / F(places)
            pooled[width + k] = max(pooled[width + k], token[j, k])
        linear(token[j], weights.key, out, False)
        for k in range(width):
            key[k, j] = out[k]
    reserve = np.empty(1, dtype=np.float32)
    linear(pooled, weights.reserve1, out, True)
    linear(out, weights.reserve2, reserve, False)
    score: float = reserve[0]
    return score


@compiled_fast_math
def mix_and_normalise(weights: Weights, token: Floats) -> None:
    """Apply the residual network and the layer normalisation to each place, shape (m + 1, width), in place."""
    places, width = token.shape
    hidden = np.empty(2 * width, dtype=np.float32)
    out = np.empty(width, dtype=np.float32)
    for j in range(places):
        linear(token[j], weights.mix1, hidden, True)
        linear(hidden, weights.mix2, out, False)
        mean = F(0)
        for k in range(width):
            token[j, k] += out[k]
            mean += token[j, k]
        mean /= F(width)
        spread = F(0)
        for k in range(width):
            spread += (token[j, k] - mean) ** 2
        factor = F(1) / np.sqrt(spread / F(width) + F(1e-5))
        for k in range(width):
            token[j, k] = (token[j, k] - mean) * factor


@compiled_fast_math
def embed_tasks(
    game: GameArrays, task: Ints, group: Floats, shortfall: Floats, weights: Weights, token: Floats
) -> None:
    """Embed the features of each place (`observe_tasks`) into `token`, shape (m + 1, width)."""
    places = len(shortfall)
    members = np.zeros(places, dtype=np.float32)
    for agent in range(len(task)):
        if game.ability[agent] > 0:
            members[task[agent]] += F(1)
    x = np.empty(TASK_FEATURES, dtype=np.float32)
    fill_shared_features(game, group, shortfall, x)
    for j in range(places):
        need = max(game.need[j], F(SMALLEST))
        x[TaskFeature.SHORTFALL_PER_NEED.value] = clip(shortfall[j] / need)
        x[TaskFeature.SHORTFALL.value] = clip(shortfall[j] / F(SHORTFALL_DIVISOR))
        x[TaskFeature.FINE_SHORTFALL_PER_NEED.value] = clip(F(FINE_FACTOR) * shortfall[j] / need)
        x[TaskFeature.LOG_NEED.value] = clip(game.log_need[j] - F(LOG_NEED_OFFSET))
        x[TaskFeature.MEAN_CONTRIBUTION.value] = clip(group[j] / max(members[j], F(1)) - F(1))
        x[TaskFeature.LOG_MEMBERS.value] = clip(np.log1p(members[j]) - F(LOG_NEED_OFFSET))
        x[TaskFeature.IS_IDLE_PLACE.value] = F(1) if j == places - 1 else F(0)
        x[TaskFeature.SUPPLY_RATIO.value] = clip(game.supply_ratio[j])
        linear(x, weights.embed, token[j], True)


@compiled_fast_math
def fill_shared_features(game: GameArrays, group: Floats, shortfall: Floats, x: Floats) -> None:
    """Fill the features that all places share: of all tasks together."""
    total, short, surplus, lowest = F(0), F(0), F(0), F(np.inf)
    for j in range(len(shortfall) - 1):
        total += game.need[j]
        short += positive(shortfall[j])
        surplus += positive(-shortfall[j])
        lowest = min(lowest, group[j] / max(game.need[j], F(SMALLEST)) if game.need[j] > 0 else F(1))
    total = max(total, F(1e-9))
    short, surplus = short / total, surplus / total
    x[TaskFeature.LOWEST_COVERAGE.value] = clip(lowest)
    x[TaskFeature.TOTAL_SHORTFALL.value] = clip(F(FINE_FACTOR) * short)
    x[TaskFeature.NET_SURPLUS.value] = clip(F(FINE_FACTOR) * (surplus - short))
    x[TaskFeature.ENERGY_WEIGHT.value] = clip(F(game.energy_weight) - F(1))


@compiled_fast_math
def attend_to_members(
    game: GameArrays, slot: Ints, task: Ints, shortfall: Floats, weights: Weights, token: Floats
) -> None:
    """Let each group attend to its members (`ActorCritic._members`), and add the outcome to `token`."""
    places, width = token.shape
    heads = len(weights.slope)
    each = width // heads
    x = np.empty(AGENT_FEATURES, dtype=np.float32)
    member = np.empty(width + heads, dtype=np.float32)
    attended = np.zeros((places, width), dtype=np.float32)
    weight = np.zeros((places, heads), dtype=np.float32)
    for agent in range(len(task)):
        if not game.ability[agent] > 0:
            continue
        place = task[agent]
        fill_agent_features(game, shortfall, agent, slot[agent], x)
        linear(x, weights.member, member, False)
        for h in range(heads):
            share = np.exp(F(8) * np.tanh(member[h] / F(8)))
            weight[place, h] += share
            for k in range(h * each, (h + 1) * each):
                attended[place, k] += share * positive(member[heads + k])
    out = np.empty(width, dtype=np.float32)
    for j in range(places):
        for k in range(width):
            attended[j, k] /= weight[j, k // each] + F(1e-6)
        linear(attended[j], weights.gather, out, False)
        for k in range(width):
            token[j, k] += out[k]


@compiled_fast_math
def fill_agent_features(game: GameArrays, shortfall: Floats, agent: int, own: int, x: Floats) -> None:
    """Fill the features of an agent at its candidate `own` (`observe_agents`), shape (AGENT_FEATURES,)."""
    place, contribution, distance = (
        game.candidates[agent, own],
        game.contribution[agent, own],
        game.distance[agent, own],
    )
    own_shortfall, own_need = shortfall[place], max(game.need[place], F(SMALLEST))
    divisor = max(contribution, F(SMALLEST))
    x[AgentFeature.ABILITY.value] = clip(game.ability[agent] - F(1))
    x[AgentFeature.SHORTFALL_PER_CONTRIBUTION.value] = clip(own_shortfall / divisor / F(SHORTFALL_DIVISOR))
    x[AgentFeature.SHORTFALL_WITHOUT_PER_CONTRIBUTION.value] = clip_to_one((own_shortfall + contribution) / divisor)
    x[AgentFeature.CONTRIBUTION_PER_NEED.value] = clip(contribution / own_need)
    x[AgentFeature.DISTANCE.value] = clip(distance)
    x[AgentFeature.ENERGY_COST.value] = clip(F(game.energy_weight) * distance)
    x[AgentFeature.REACHABLE_SHARE.value] = clip(game.reachable_share[agent])
    x[AgentFeature.SHORTFALL_PER_NEED.value] = clip(own_shortfall / own_need)


@compiled_fast_math
def attend_to_neighbours(game: GameArrays, weights: Weights, token: Floats) -> None:
    """Let places attend to each other (`ActorCritic._neighbours`), and add the outcome to `token`."""
    places, width = token.shape
    heads = len(weights.slope)
    each = width // heads
    projected = np.empty((places, 3 * width), dtype=np.float32)  # queries, keys and values
    for j in range(places):
        linear(token[j], weights.attend, projected[j], False)
    key = np.empty((width, places), dtype=np.float32)
    for j in range(places):
        for k in range(width):
            key[k, j] = projected[j, width + k]
    share = np.empty(places, dtype=np.float32)
    attended = np.empty(width, dtype=np.float32)
    out = np.empty(width, dtype=np.float32)
    scale = F(1) / np.sqrt(F(each))
    for j in range(places):
        attended[:] = 0
        for h in range(heads):
            for i in range(places):
                share[i] = -weights.slope[h] * game.task_distance[j, i]
            for k in range(h * each, (h + 1) * each):
                factor = projected[j, k] * scale
                for i in range(places):
                    share[i] += factor * key[k, i]
            softmax(share)
            for i in range(places):
                for k in range(h * each, (h + 1) * each):
                    attended[k] += share[i] * projected[i, 2 * width + k]
        linear(attended, weights.spread, out, False)
        for k in range(width):
            token[j, k] += out[k]


@inlined
def softmax(values: Floats) -> None:
    """Replace values, shape (k,), by their softmax."""
    largest = values.max()
    total = F(0)
    for i in range(len(values)):
        values[i] = np.exp(values[i] - largest)
        total += values[i]
    for i in range(len(values)):
        values[i] /= total
