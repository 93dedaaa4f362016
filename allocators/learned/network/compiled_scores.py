"""The local part of the scores of `ActorCritic` in compiled loops: an agent's features, and a small network on them.

The features are those of `problems.game.observation.pair_features` in single precision; tests compare the two.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.network.compiled_layers import F, Flags, Floats, clip, clip_to_one, positive
from alloc.allocators.learned.network.game_arrays import GameArrays
from alloc.allocators.learned.network.weights import Weights
from alloc.allocators.runtime.compiled import compiled_loosely, inlined
from alloc.problems.game.board import SMALLEST
from alloc.problems.game.features import IDLE_SURPLUS, LOG_NEED_OFFSET, PAIR_FEATURES, SHORTFALL_DIVISOR, PairFeature


class PairBuffers(NamedTuple):
    """Room for the features of a pair and for the hidden layers."""

    features: Floats
    hidden1: Floats
    hidden2: Floats


@compiled_loosely
def pair_buffers(weights: Weights) -> PairBuffers:
    """Return room for `score_agent`."""
    return PairBuffers(
        np.empty(PAIR_FEATURES, dtype=np.float32),
        np.empty(weights.local2.shape[0] - 1, dtype=np.float32),
        np.empty(weights.local3.shape[0] - 1, dtype=np.float32),
    )


@compiled_loosely
def score_agent(
    game: GameArrays,
    weights: Weights,
    shortfall: Floats,
    agent: int,
    own: int,
    wanted: Flags,
    buffers: PairBuffers,
    out: Floats,
) -> None:
    """Fill the local scores of an agent's bids for the wanted candidates, where it is at the candidate `own` now.

    Parameters
    ----------
    shortfall : ndarray, shape (m + 1,)
    wanted : ndarray of bool, shape (c,)
    out : ndarray, shape (c,)
    """
    x = buffers.features
    eased = fill_own_features(game, shortfall, agent, own, x)
    per_ability = F(1) / max(game.ability[agent], F(SMALLEST))
    for k in range(len(wanted)):
        if wanted[k]:
            fill_candidate_features(game, shortfall, agent, own, k, eased, per_ability, x)
            out[k] = local_score(weights, x, buffers.hidden1, buffers.hidden2)


@inlined
def fill_own_features(game: GameArrays, shortfall: Floats, agent: int, own: int, x: Floats) -> float:
    """Fill the features that do not depend on the candidate; return by how much shortfall rises where it leaves."""
    here, contribution = game.candidates[agent, own], game.contribution[agent, own]
    own_shortfall, energy_weight = shortfall[here], F(game.energy_weight)
    own_after = own_shortfall + contribution
    per_contribution, per_need = F(1) / max(contribution, F(SMALLEST)), F(1) / max(game.need[here], F(SMALLEST))
    x[PairFeature.OWN_SHORTFALL_PER_CONTRIBUTION] = clip(own_shortfall * per_contribution * F(1 / SHORTFALL_DIVISOR))
    x[PairFeature.OWN_SHORTFALL_AFTER_PER_CONTRIBUTION] = clip_to_one(own_after * per_contribution)
    x[PairFeature.OWN_SHORTFALL_PER_NEED] = clip(own_shortfall * per_need)
    x[PairFeature.OWN_SHORTFALL_AFTER_PER_NEED] = clip(own_after * per_need)
    x[PairFeature.ENERGY_WEIGHT] = clip(energy_weight - F(1))
    x[PairFeature.OWN_LOG_NEED] = clip(game.log_need[here] - F(LOG_NEED_OFFSET))
    x[PairFeature.ABILITY] = clip(game.ability[agent] - F(1))
    x[PairFeature.OWN_SUPPLY_RATIO] = clip(game.supply_ratio[here])
    x[PairFeature.REACHABLE_SHARE] = clip(game.reachable_share[agent])
    return positive(own_shortfall) - positive(own_after)


@inlined
def fill_candidate_features(
    game: GameArrays, shortfall: Floats, agent: int, own: int, k: int, eased: float, per_ability: float, x: Floats
) -> None:
    """Fill the features of an agent and its candidate `k`, besides those of `fill_own_features`."""
    there, contribution, distance = game.candidates[agent, k], game.contribution[agent, k], game.distance[agent, k]
    its_shortfall = shortfall[there]
    after = its_shortfall - contribution
    per_contribution, per_need = F(1) / max(contribution, F(SMALLEST)), F(1) / max(game.need[there], F(SMALLEST))
    extra = distance - game.distance[agent, own]
    gain = positive(its_shortfall) - positive(after) + eased
    x[PairFeature.SHORTFALL_PER_CONTRIBUTION] = clip(its_shortfall * per_contribution * F(1 / SHORTFALL_DIVISOR))
    x[PairFeature.SHORTFALL_AFTER_PER_CONTRIBUTION] = clip_to_one(after * per_contribution)
    x[PairFeature.SHORTFALL_PER_NEED] = clip(its_shortfall * per_need)
    x[PairFeature.SHORTFALL_AFTER_PER_NEED] = clip(after * per_need)
    x[PairFeature.EXTRA_DISTANCE] = clip(extra)
    x[PairFeature.DISTANCE] = clip(distance)
    x[PairFeature.EXTRA_ENERGY_COST] = clip(F(game.energy_weight) * extra)
    x[PairFeature.LOG_NEED] = clip(game.log_need[there] - F(LOG_NEED_OFFSET))
    x[PairFeature.GAIN_PER_CONTRIBUTION] = clip(gain * per_contribution)
    x[PairFeature.GAIN] = clip(gain)
    x[PairFeature.IS_IDLE_PLACE] = F(1) if its_shortfall < F(-IDLE_SURPLUS / 2) else F(0)
    x[PairFeature.SUPPLY_RATIO] = clip(game.supply_ratio[there])
    x[PairFeature.CONTRIBUTION_PER_ABILITY] = clip(contribution * per_ability - F(1))


@inlined
def local_score(weights: Weights, x: Floats, hidden1: Floats, hidden2: Floats) -> float:
    """Return the local score of a pair by its features (`ActorCritic.pairs`)."""
    first, second, third = weights.local1, weights.local2, weights.local3
    width = len(hidden1)
    for h in range(width):
        hidden1[h] = first[PAIR_FEATURES, h]
    for j in range(PAIR_FEATURES):
        factor = x[j]
        for h in range(width):
            hidden1[h] += factor * first[j, h]
    for h in range(width):
        hidden2[h] = second[width, h]
    for j in range(width):
        factor = hidden1[j]
        if factor > 0:
            for h in range(width):
                hidden2[h] += factor * second[j, h]
    total: float = third[width, 0]
    for h in range(width):
        total += positive(hidden2[h]) * third[h, 0]
    return total
