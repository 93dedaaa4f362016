"""The local part of the scores of `ActorCritic` in compiled loops: features of pairs, and a small network on them.

The features are those of `problems.game.observation.pair_features` in single precision. The formulas stand twice, as
torch works on all pairs at once, and a loop on the pairs that have changed, with no array in between.
`test_compiled_games_match_torch` holds both to the same games.
numba before 0.68 takes the value of an IntEnum as an index, not its member.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.network.compiled_layers import F, Flags, Floats, clip, clip_to_one, positive
from alloc.allocators.learned.network.game_arrays import GameArrays
from alloc.allocators.learned.network.weights import Weights
from alloc.allocators.runtime.compiled import compiled_fast_math, inlined
from alloc.problems.game.board import SMALLEST
from alloc.problems.game.features import IDLE_SURPLUS, LOG_NEED_OFFSET, PAIR_FEATURES, SHORTFALL_DIVISOR, PairFeature


class PairBuffers(NamedTuple):
    """Room for the features of an agent's candidates, shape (c, PAIR_FEATURES), and for the hidden layers."""

    features: Floats
    hidden1: Floats
    hidden2: Floats


@compiled_fast_math
def pair_buffers(game: GameArrays, weights: Weights) -> PairBuffers:
    """Return room for `score_agent`."""
    return PairBuffers(
        np.empty((game.legal.shape[1], PAIR_FEATURES), dtype=np.float32),
        np.empty(weights.local2.shape[0] - 1, dtype=np.float32),
        np.empty(weights.local3.shape[0] - 1, dtype=np.float32),
    )


@compiled_fast_math
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
    fill_pair_features(game, shortfall, agent, own, wanted, buffers.features)
    fill_local_scores(weights, buffers.features, wanted, buffers.hidden1, buffers.hidden2, out)


@inlined
def fill_pair_features(game: GameArrays, shortfall: Floats, agent: int, own: int, wanted: Flags, x: Floats) -> None:
    """Fill the features of the wanted candidates of an agent that is at `own`, shape (c, PAIR_FEATURES)."""
    candidates, contributions, distances = game.candidates[agent], game.contribution[agent], game.distance[agent]
    here, given, energy_weight = candidates[own], contributions[own], F(game.energy_weight)
    per_given, per_own_need = F(1) / max(given, F(SMALLEST)), F(1) / max(game.need[here], F(SMALLEST))
    own_shortfall, own_after = shortfall[here], shortfall[here] + given
    own_increase = positive(own_shortfall) - positive(own_after)
    ability = game.ability[agent]
    per_ability = F(1) / max(ability, F(SMALLEST))
    for k in range(len(wanted)):
        if not wanted[k]:
            continue
        there, brought, distance = candidates[k], contributions[k], distances[k]
        per_brought, per_need = F(1) / max(brought, F(SMALLEST)), F(1) / max(game.need[there], F(SMALLEST))
        its_shortfall, after = shortfall[there], shortfall[there] - brought
        extra = distance - distances[own]
        gain = positive(its_shortfall) - positive(after) + own_increase
        x[k, PairFeature.SHORTFALL_PER_CONTRIBUTION.value] = clip(
            its_shortfall * per_brought * F(1 / SHORTFALL_DIVISOR)
        )
        x[k, PairFeature.SHORTFALL_AFTER_PER_CONTRIBUTION.value] = clip_to_one(after * per_brought)
        x[k, PairFeature.OWN_SHORTFALL_PER_CONTRIBUTION.value] = clip(
            own_shortfall * per_given * F(1 / SHORTFALL_DIVISOR)
        )
        x[k, PairFeature.OWN_SHORTFALL_AFTER_PER_CONTRIBUTION.value] = clip_to_one(own_after * per_given)
        x[k, PairFeature.SHORTFALL_PER_NEED.value] = clip(its_shortfall * per_need)
        x[k, PairFeature.SHORTFALL_AFTER_PER_NEED.value] = clip(after * per_need)
        x[k, PairFeature.OWN_SHORTFALL_PER_NEED.value] = clip(own_shortfall * per_own_need)
        x[k, PairFeature.OWN_SHORTFALL_AFTER_PER_NEED.value] = clip(own_after * per_own_need)
        x[k, PairFeature.EXTRA_DISTANCE.value] = clip(extra)
        x[k, PairFeature.DISTANCE.value] = clip(distance)
        x[k, PairFeature.EXTRA_ENERGY_COST.value] = clip(energy_weight * extra)
        x[k, PairFeature.ENERGY_WEIGHT.value] = clip(energy_weight - F(1))
        x[k, PairFeature.LOG_NEED.value] = clip(game.log_need[there] - F(LOG_NEED_OFFSET))
        x[k, PairFeature.OWN_LOG_NEED.value] = clip(game.log_need[here] - F(LOG_NEED_OFFSET))
        x[k, PairFeature.ABILITY.value] = clip(ability - F(1))
        x[k, PairFeature.GAIN_PER_CONTRIBUTION.value] = clip(gain * per_brought)
        x[k, PairFeature.GAIN.value] = clip(gain)
        x[k, PairFeature.IS_IDLE_PLACE.value] = F(1) if its_shortfall < F(-IDLE_SURPLUS / 2) else F(0)
        x[k, PairFeature.OWN_SUPPLY_RATIO.value] = clip(game.supply_ratio[here])
        x[k, PairFeature.SUPPLY_RATIO.value] = clip(game.supply_ratio[there])
        x[k, PairFeature.REACHABLE_SHARE.value] = clip(game.reachable_share[agent])
        x[k, PairFeature.CONTRIBUTION_PER_ABILITY.value] = clip(brought * per_ability - F(1))


@inlined
def fill_local_scores(
    weights: Weights, x: Floats, wanted: Flags, hidden1: Floats, hidden2: Floats, out: Floats
) -> None:
    """Fill the local scores of the wanted candidates by their features (`ActorCritic.pairs`), shape (c,)."""
    first, second, third = weights.local1, weights.local2, weights.local3
    width = len(hidden1)
    for k in range(len(wanted)):
        if not wanted[k]:
            continue
        for h in range(width):
            hidden1[h] = first[PAIR_FEATURES, h]
        for j in range(PAIR_FEATURES):
            factor = x[k, j]
            for h in range(width):
                hidden1[h] += factor * first[j, h]
        for h in range(width):
            hidden2[h] = second[width, h]
        for j in range(width):
            factor = hidden1[j]
            if factor > 0:
                for h in range(width):
                    hidden2[h] += factor * second[j, h]
        total = third[width, 0]
        for h in range(width):
            total += positive(hidden2[h]) * third[h, 0]
        out[k] = total
