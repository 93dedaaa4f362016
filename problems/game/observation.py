"""Observations: dimensionless features of `Board` and `State`, independent of scale and number of agents."""

from collections.abc import Mapping
from enum import IntEnum
from typing import NamedTuple

import torch
from torch import Tensor

from alloc.problems.game.board import SMALLEST, Board
from alloc.problems.game.features import (
    FEATURE_LIMIT,
    FINE_FACTOR,
    IDLE_SURPLUS,
    LOG_NEED_OFFSET,
    SHORTFALL_DIVISOR,
    AgentFeature,
    PairFeature,
    TaskFeature,
)
from alloc.problems.game.rules import State, at_slot, current_tasks


class AgentAtPlace(NamedTuple):
    """A place and an agent's values there, as tensors that broadcast.

    Attributes
    ----------
    shortfall, need, supply_ratio : Tensor
        Values of the place.
    contribution, distance : Tensor
        Values of the agent at this place.
    """

    shortfall: Tensor
    need: Tensor
    supply_ratio: Tensor
    contribution: Tensor
    distance: Tensor


def shortfalls(board: Board, state: State) -> Tensor:
    """Return the shortfall of ability at each place, negative for a surplus, shape (B, m + 1)."""
    shortfall = board.need - state.group
    shortfall[:, -1] = -IDLE_SURPLUS
    return shortfall


def pair_features(
    energy_weight: Tensor, ability: Tensor, reachable_share: Tensor, own: AgentAtPlace, other: AgentAtPlace
) -> Tensor:
    """Return the `PairFeature` values of moves, shape (..., PAIR_FEATURES); the arguments broadcast to (...).

    Parameters
    ----------
    energy_weight : Tensor
    ability, reachable_share : Tensor
        Values of the agent.
    own, other : AgentAtPlace
        The agent at its own place, and at the candidate that it bids for.
    """
    per_own, per_other = own.contribution.clamp(min=SMALLEST), other.contribution.clamp(min=SMALLEST)
    own_after, after = own.shortfall + own.contribution, other.shortfall - other.contribution
    extra = other.distance - own.distance
    gain = other.shortfall.clamp(min=0) + own.shortfall.clamp(min=0)
    gain = gain - after.clamp(min=0) - own_after.clamp(min=0)
    return _stacked(
        {
            PairFeature.SHORTFALL_PER_CONTRIBUTION: other.shortfall / per_other / SHORTFALL_DIVISOR,
            PairFeature.SHORTFALL_AFTER_PER_CONTRIBUTION: (after / per_other).clamp(-1, 1),
            PairFeature.OWN_SHORTFALL_PER_CONTRIBUTION: own.shortfall / per_own / SHORTFALL_DIVISOR,
            PairFeature.OWN_SHORTFALL_AFTER_PER_CONTRIBUTION: (own_after / per_own).clamp(-1, 1),
            PairFeature.SHORTFALL_PER_NEED: other.shortfall / other.need,
            PairFeature.SHORTFALL_AFTER_PER_NEED: after / other.need,
            PairFeature.OWN_SHORTFALL_PER_NEED: own.shortfall / own.need,
            PairFeature.OWN_SHORTFALL_AFTER_PER_NEED: own_after / own.need,
            PairFeature.EXTRA_DISTANCE: extra,
            PairFeature.DISTANCE: other.distance,
            PairFeature.EXTRA_ENERGY_COST: energy_weight * extra,
            PairFeature.ENERGY_WEIGHT: energy_weight - 1,
            PairFeature.LOG_NEED: other.need.log() - LOG_NEED_OFFSET,
            PairFeature.OWN_LOG_NEED: own.need.log() - LOG_NEED_OFFSET,
            PairFeature.ABILITY: ability - 1,
            PairFeature.GAIN_PER_CONTRIBUTION: gain / per_other,
            PairFeature.GAIN: gain,
            PairFeature.IS_IDLE_PLACE: (other.shortfall < -IDLE_SURPLUS / 2).float(),
            PairFeature.OWN_SUPPLY_RATIO: own.supply_ratio,
            PairFeature.SUPPLY_RATIO: other.supply_ratio,
            PairFeature.REACHABLE_SHARE: reachable_share,
            PairFeature.CONTRIBUTION_PER_ABILITY: other.contribution / ability.clamp(min=SMALLEST) - 1,
        }
    )


def observe_pairs(board: Board, state: State) -> Tensor:
    """Return `pair_features` of every agent and candidate, shape (B, n, c, PAIR_FEATURES)."""
    shortfall, need = shortfalls(board, state), board.need.clamp(min=SMALLEST)
    task = current_tasks(board, state)

    def here(values: Tensor) -> Tensor:
        return values.gather(1, task)[..., None]

    def there(values: Tensor) -> Tensor:
        return values.gather(1, board.candidates.flatten(1)).view(board.shape)

    contribution = at_slot(board.contribution, state.slot)[..., None]
    distance = at_slot(board.distance, state.slot)[..., None]
    own = AgentAtPlace(here(shortfall), here(need), here(board.supply_ratio), contribution, distance)
    other = AgentAtPlace(there(shortfall), there(need), there(board.supply_ratio), board.contribution, board.distance)
    return pair_features(
        board.energy_weight[:, None, None], board.ability[..., None], board.reachable_share[..., None], own, other
    )


def observe_agents(board: Board, state: State) -> Tensor:
    """Return the `AgentFeature` values of each agent at its own place, shape (B, n, AGENT_FEATURES)."""
    shortfall, need, task = shortfalls(board, state), board.need.clamp(min=SMALLEST), current_tasks(board, state)
    own_shortfall, own_need = shortfall.gather(1, task), need.gather(1, task)
    contribution, distance = at_slot(board.contribution, state.slot), at_slot(board.distance, state.slot)
    per_contribution = contribution.clamp(min=SMALLEST)
    return _stacked(
        {
            AgentFeature.ABILITY: board.ability - 1,
            AgentFeature.SHORTFALL_PER_CONTRIBUTION: own_shortfall / per_contribution / SHORTFALL_DIVISOR,
            AgentFeature.SHORTFALL_WITHOUT_PER_CONTRIBUTION: ((own_shortfall + contribution) / per_contribution).clamp(
                -1, 1
            ),
            AgentFeature.CONTRIBUTION_PER_NEED: contribution / own_need,
            AgentFeature.DISTANCE: distance,
            AgentFeature.ENERGY_COST: board.energy_weight[:, None] * distance,
            AgentFeature.REACHABLE_SHARE: board.reachable_share,
            AgentFeature.SHORTFALL_PER_NEED: own_shortfall / own_need,
        }
    )


def observe_tasks(board: Board, state: State) -> Tensor:
    """Return the `TaskFeature` values of each place, shape (B, m + 1, TASK_FEATURES)."""
    shortfall, need = shortfalls(board, state), board.need.clamp(min=SMALLEST)
    members = torch.zeros_like(need).scatter_add_(1, current_tasks(board, state), (board.ability > 0).float())
    needed = board.need[:, :-1] > 0
    lowest = (state.group / need)[:, :-1].masked_fill(~needed, 1.0).amin(1)
    short = shortfall[:, :-1].clamp(min=0).sum(1) / need[:, :-1].sum(1)
    surplus = (-shortfall[:, :-1]).clamp(min=0).sum(1) / need[:, :-1].sum(1)
    idle = torch.zeros_like(need)
    idle[:, -1] = 1.0
    return _stacked(
        {
            TaskFeature.SHORTFALL_PER_NEED: shortfall / need,
            TaskFeature.SHORTFALL: shortfall / SHORTFALL_DIVISOR,
            TaskFeature.FINE_SHORTFALL_PER_NEED: FINE_FACTOR * shortfall / need,
            TaskFeature.LOG_NEED: need.log() - LOG_NEED_OFFSET,
            TaskFeature.MEAN_CONTRIBUTION: state.group / members.clamp(min=1) - 1,
            TaskFeature.LOG_MEMBERS: members.log1p() - LOG_NEED_OFFSET,
            TaskFeature.IS_IDLE_PLACE: idle,
            TaskFeature.LOWEST_COVERAGE: lowest[:, None],
            TaskFeature.TOTAL_SHORTFALL: FINE_FACTOR * short[:, None],
            TaskFeature.NET_SURPLUS: FINE_FACTOR * (surplus - short)[:, None],
            TaskFeature.ENERGY_WEIGHT: board.energy_weight[:, None] - 1,
            TaskFeature.SUPPLY_RATIO: board.supply_ratio,
        }
    )


def _stacked(values: Mapping[IntEnum, Tensor]) -> Tensor:
    """Stack features, which broadcast to (...), by index along a last axis, clipped to `FEATURE_LIMIT`."""
    columns = torch.broadcast_tensors(*(values[feature] for feature in sorted(values)))
    return torch.stack(columns, -1).clamp(-FEATURE_LIMIT, FEATURE_LIMIT)
