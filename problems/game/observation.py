"""What agents see: local figures without units, so that one policy serves any scale and any number of agents."""

import torch
from torch import Tensor

from alloc.problems.game.board import LEAST, Board
from alloc.problems.game.rules import State, pick, tasks_of

SURPLUS = 1e6
"""Surplus of ability that the place of the idle is credited with: leaving it costs nobody anything."""

PAIR_FEATURES = 22
TASK_FEATURES = 12
AGENT_FEATURES = 8
FEATURE_SET = "bidding-3"
"""Name of what is observed; policies trained on another set do not load."""

Sight = tuple[Tensor, Tensor, Tensor, Tensor, Tensor]
"""Of a place: lack, need, supply; and of an agent there: contribution and distance."""


def lacks(board: Board, state: State) -> Tensor:
    """Return the ability that each place lacks, negative where it has too much, shape (B, m + 1)."""
    lack = board.need - state.group
    lack[:, -1] = -SURPLUS
    return lack


def pair_features(price: Tensor, ability: Tensor, choice: Tensor, own: Sight, other: Sight) -> Tensor:
    """Return what an agent knows of a move, shape (..., PAIR_FEATURES); the arguments broadcast to (...).

    Parameters
    ----------
    price : Tensor
        Weight of energy.
    ability, choice : Tensor
        Of the agent.
    own, other : Sight
        Of the place where the agent is, and of the one that it bids for.
    """
    own_lack, own_need, own_supply, given, own_distance = own
    lack, need, supply, brought, distance = other
    gives, brings = given.clamp(min=LEAST), brought.clamp(min=LEAST)
    further = distance - own_distance
    gain = lack.clamp(min=0) + own_lack.clamp(min=0)
    gain = gain - (lack - brought).clamp(min=0) - (own_lack + given).clamp(min=0)
    columns = [
        lack / brings / 3,
        ((lack - brought) / brings).clamp(-1, 1),
        own_lack / gives / 3,
        ((own_lack + given) / gives).clamp(-1, 1),
        lack / need,
        (lack - brought) / need,
        own_lack / own_need,
        (own_lack + given) / own_need,
        further,
        distance,
        price * further,
        price - 1,
        need.log() - 1.5,
        own_need.log() - 1.5,
        ability - 1,
        gain / brings,
        gain,
        (lack < -SURPLUS / 2).float(),
        own_supply,
        supply,
        choice,
        brought / ability.clamp(min=LEAST) - 1,
    ]
    return torch.stack(torch.broadcast_tensors(*columns), -1).clamp(-2, 2)


def observe_pairs(board: Board, state: State) -> Tensor:
    """Return `pair_features` of every agent and candidate, shape (B, n, c, PAIR_FEATURES)."""
    lack, need = lacks(board, state), board.need.clamp(min=LEAST)
    task = tasks_of(board, state)

    def here(values: Tensor) -> Tensor:
        return values.gather(1, task)[..., None]

    def there(values: Tensor) -> Tensor:
        return values.gather(1, board.goal.flatten(1)).view(board.shape)

    given, near = pick(board.contribution, state.slot)[..., None], pick(board.distance, state.slot)[..., None]
    own = (here(lack), here(need), here(board.supply), given, near)
    other = (there(lack), there(need), there(board.supply), board.contribution, board.distance)
    return pair_features(board.price[:, None, None], board.ability[..., None], board.choice[..., None], own, other)


def observe_agents(board: Board, state: State) -> Tensor:
    """Return what is known of each agent where it is, shape (B, n, AGENT_FEATURES)."""
    lack, need, task = lacks(board, state), board.need.clamp(min=LEAST), tasks_of(board, state)
    own_lack, own_need = lack.gather(1, task), need.gather(1, task)
    given, distance = pick(board.contribution, state.slot), pick(board.distance, state.slot)
    price = board.price[:, None]
    columns = [
        board.ability - 1,
        own_lack / given.clamp(min=LEAST) / 3,
        ((own_lack + given) / given.clamp(min=LEAST)).clamp(-1, 1),
        given / own_need,
        distance,
        price * distance,
        board.choice,
        own_lack / own_need,
    ]
    return torch.stack(columns, -1).clamp(-2, 2)


def observe_tasks(board: Board, state: State) -> Tensor:
    """Return what is known of each place and of all together, shape (B, m + 1, TASK_FEATURES)."""
    lack, need = lacks(board, state), board.need.clamp(min=LEAST)
    members = torch.zeros_like(need).scatter_add_(1, tasks_of(board, state), (board.ability > 0).float())
    needed = board.need[:, :-1] > 0
    ratio = (state.group / need)[:, :-1].masked_fill(~needed, 1.0).amin(1)
    short = lack[:, :-1].clamp(min=0).sum(1) / need[:, :-1].sum(1)
    spare = (-lack[:, :-1]).clamp(min=0).sum(1) / need[:, :-1].sum(1)
    idle = torch.zeros_like(need)
    idle[:, -1] = 1.0
    everywhere = need.shape
    columns = [
        lack / need,
        lack / 3,
        5 * lack / need,
        need.log() - 1.5,
        state.group / members.clamp(min=1) - 1,
        members.log1p() - 1.5,
        idle,
        ratio[:, None].expand(everywhere),
        5 * short[:, None].expand(everywhere),
        5 * (spare - short)[:, None].expand(everywhere),
        board.price[:, None].expand(everywhere) - 1,
        board.supply,
    ]
    return torch.stack(columns, -1).clamp(-2, 2)
