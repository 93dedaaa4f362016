"""Rewards: the utility of a state, and the marginal contributions of actions to it."""

from collections.abc import Callable

import torch
from torch import Tensor

from alloc.problems.game.board import Board
from alloc.problems.game.rules import PLANNING, Rules, State, at_slot, group_ability, mean_distance
from alloc.problems.vocabulary import Reward

LARGEST_EXPONENT = 20.0
"""Exponent in (3) beyond which the reward is extended linearly, as it overflows for large shortfalls."""

DIVISOR = 1e-9


def potential(board: Board, group: Tensor) -> Tensor:
    """Return a potential of the groups, which is at most 0, its value if all needs are met.

    Minus the relative shortfall of ability in total (times 4), on average (times 2, both weighted by priority), and of
    the worst task, which is 1 - T_ref / T and thus measures the makespan.

    Parameters
    ----------
    group : Tensor, shape (B, m + 1) or (..., B, m + 1)

    Returns
    -------
    Tensor, shape (B,) or (..., B)
    """
    need, weight = board.need[:, :-1], board.weight[:, :-1]
    shortfall = (need - group[..., :-1]).clamp(min=0) / need.clamp(min=DIVISOR) * (need > 0)
    total = (shortfall * need * weight).sum(-1) / need.sum(-1).clamp(min=DIVISOR)
    mean = (shortfall * weight).sum(-1) / (need > 0).sum(-1).clamp(min=1)
    return -4 * total - 2 * mean - shortfall.amax(-1)


def coverage(board: Board, group: Tensor) -> Tensor:
    """Return the mean of (3), -tau^(W_j - h_j), over the tasks, weighted by priority.

    Beyond the exponent `LARGEST_EXPONENT`, the exponential is extended by its tangent: finite, and still decreasing
    with the shortfall.
    """
    need, weight = board.need[:, :-1], board.weight[:, :-1]
    exponent = (group[..., :-1] - need) * board.log_tau[:, None]
    beyond = (exponent - LARGEST_EXPONENT).clamp(min=0)
    reward = -exponent.clamp(max=LARGEST_EXPONENT).exp() * (1 + beyond)
    return (reward * weight * (need > 0)).sum(-1) / (need > 0).sum(-1).clamp(min=1)


def utility(board: Board, state: State, rules: Rules = PLANNING) -> Tensor:
    """Return the utility of each state, shape (B,): potential or coverage, minus the weighted energy."""
    return _group_value(rules)(board, state.group) - board.energy_weight * mean_distance(board, state, rules)


def marginal_contributions(board: Board, state: State, granted: Tensor, rules: Rules = PLANNING) -> Tensor:
    """Return the marginal contribution of each granted bid, given the bids before it; 0 for invalid bids.

    Parameters
    ----------
    state : State
        State before the step.
    granted : Tensor of int, shape (B, k)
        Bids, ``agent * c + slot``; other values are ignored.

    Returns
    -------
    Tensor, shape (B, k)
        Contributions, which sum to the increase of `utility`.
    """
    _, n, c = board.shape
    value, agent_count = _group_value(rules), board.agent_count
    rows = torch.arange(len(granted), device=granted.device)
    group, before = state.group, value(board, state.group)
    contributions = []
    for bid in granted.unbind(1):
        real = (bid >= 0) & (bid < n * c)
        agent, slot = torch.div(bid.clamp(min=0, max=n * c - 1), c, rounding_mode="floor"), bid.clamp(min=0) % c
        now = state.slot[rows, agent]
        group = group.clone()
        group[rows, board.candidates[rows, agent, now]] -= board.contribution[rows, agent, now] * real
        group[rows, board.candidates[rows, agent, slot]] += board.contribution[rows, agent, slot] * real
        after = value(board, group)
        extra = _extra_distance(board, state, agent, slot, rules) * real
        contributions.append(after - before - board.energy_weight * extra / agent_count)
        before = after
    return torch.stack(contributions, 1)


def difference_rewards(board: Board, state: State, slot: Tensor, rules: Rules = PLANNING) -> Tensor:
    """Return the loss of utility if each agent alone had stayed, for simultaneous choices.

    Parameters
    ----------
    state : State
        State before the step.
    slot : Tensor of int, shape (B, n)
        Candidate to which each agent goes.

    Returns
    -------
    Tensor, shape (B, n)

    References
    ----------
    Wolpert and Tumer (2001), doi:10.1142/S0219525901000188.
    """
    _, n, _ = board.shape
    value, places = _group_value(rules), board.places
    after = group_ability(board, slot)

    def share(chosen: Tensor) -> Tensor:
        one = torch.nn.functional.one_hot(at_slot(board.candidates, chosen), places)
        return (one * at_slot(board.contribution, chosen)[..., None]).transpose(0, 1)

    without = after - share(slot) + share(state.slot)
    agents = torch.arange(n, device=slot.device).expand_as(slot)
    games = torch.arange(len(slot), device=slot.device)[:, None]
    extra = _extra_distance(board, state, agents, slot, rules, games) * (slot != state.slot)
    cost = board.energy_weight[:, None] * extra / board.agent_count[:, None]
    return value(board, after)[:, None] - value(board, without).transpose(0, 1) - cost


def _group_value(rules: Rules) -> Callable[[Board, Tensor], Tensor]:
    return potential if rules.reward == Reward.MAKESPAN else coverage


def _extra_distance(
    board: Board, state: State, agent: Tensor, slot: Tensor, rules: Rules, rows: Tensor | None = None
) -> Tensor:
    """Return the additional distance of agents that go to a slot; arguments have one shape, games in `rows`."""
    rows = torch.arange(len(agent), device=agent.device) if rows is None else rows
    if rules.flying:
        place, now = board.candidates[rows, agent, slot], state.location[rows, agent]
        from_start, from_task = board.distance[rows, agent, slot], board.task_distance[rows, now, place]
        return torch.where(now == board.places - 1, from_start, from_task) * (place != board.places - 1)
    return board.distance[rows, agent, slot] - board.distance[rows, agent, state.slot[rows, agent]]


def relative_makespan(board: Board, group: Tensor) -> tuple[Tensor, Tensor]:
    """Return the makespan of the served tasks relative to the reference, and the number of unserved tasks, shape (B,).

    Parameters
    ----------
    group : Tensor, shape (B, m + 1)
        Ability at each place.
    """
    need, group = board.need[:, :-1], group[:, :-1]
    needed = need > 0
    empty = needed & (group <= 0)
    time = (need / group.clamp(min=DIVISOR)).masked_fill(~needed | empty, 0.0).amax(1)
    return time, empty.sum(1)
