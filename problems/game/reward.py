"""Rewards: how good a state is. What an action brings is the rise that it causes, its marginal contribution."""

from collections.abc import Callable

import torch
from torch import Tensor

from alloc.problems.game.board import Board
from alloc.problems.game.rules import PLANNING, Rules, State, flown, group_ability, pick
from alloc.problems.vocabulary import Reward

LARGEST_EXPONENT = 20.0
"""Exponent of e in (3) from which on the reward falls along its tangent: it overflows for large deficits."""

DIVISOR = 1e-9


def potential(board: Board, group: Tensor) -> Tensor:
    """Return how near the groups are to what the tasks need, at most 0.

    The sum of the relative shortfall of ability in total, on average (both weighed by priority), and at the worst
    task, which is 1 - T_ref / T and so the makespan.

    Parameters
    ----------
    group : Tensor, shape (B, m + 1) or (..., B, m + 1)

    Returns
    -------
    Tensor, shape (B,) or (..., B)
    """
    need, weight = board.need[:, :-1], board.weight[:, :-1]
    lack = (need - group[..., :-1]).clamp(min=0) / need.clamp(min=DIVISOR) * (need > 0)
    total = (lack * need * weight).sum(-1) / need.sum(-1).clamp(min=DIVISOR)
    mean = (lack * weight).sum(-1) / (need > 0).sum(-1).clamp(min=1)
    return -4 * total - 2 * mean - lack.amax(-1)


def coverage(board: Board, group: Tensor) -> Tensor:
    """Return the sum of (3), - tau^(W_j - h_j), over the tasks, weighed by priority and over their number.

    Where the exponent exceeds `LARGEST_EXPONENT` times e, -tau^x is continued along its tangent: finite, and still
    falling with the deficit.
    """
    need, weight = board.need[:, :-1], board.weight[:, :-1]
    exponent = (group[..., :-1] - need) * board.log_tau[:, None]
    beyond = (exponent - LARGEST_EXPONENT).clamp(min=0)
    reward = -exponent.clamp(max=LARGEST_EXPONENT).exp() * (1 + beyond)
    return (reward * weight * (need > 0)).sum(-1) / (need > 0).sum(-1).clamp(min=1)


def worth(board: Board, state: State, rules: Rules = PLANNING) -> Tensor:
    """Return how good a state is, shape (B,): potential or coverage, less the price of the energy."""
    return _gain(rules)(board, state.group) - board.price * flown(board, state, rules)


def marginal_contributions(board: Board, state: State, granted: Tensor, rules: Rules = PLANNING) -> Tensor:
    """Return what each granted bid brings when granted after those before it, shape (B, k); 0 for what is no bid.

    Parameters
    ----------
    state : State
        Before the step.
    granted : Tensor of int, shape (B, k)
        Bids, ``agent * c + slot``; anything else is none.

    Returns
    -------
    Tensor, shape (B, k)
        They add up to the rise of `worth`.
    """
    _, n, c = board.shape
    gain, crew = _gain(rules), board.crew
    rows = torch.arange(len(granted), device=granted.device)
    group, before = state.group, gain(board, state.group)
    brought = []
    for bid in granted.unbind(1):
        real = (bid >= 0) & (bid < n * c)
        agent, slot = torch.div(bid.clamp(min=0, max=n * c - 1), c, rounding_mode="floor"), bid.clamp(min=0) % c
        now = state.slot[rows, agent]
        group = group.clone()
        group[rows, board.goal[rows, agent, now]] -= board.contribution[rows, agent, now] * real
        group[rows, board.goal[rows, agent, slot]] += board.contribution[rows, agent, slot] * real
        after = gain(board, group)
        further = _further(board, state, agent, slot, rules) * real
        brought.append(after - before - board.price * further / crew)
        before = after
    return torch.stack(brought, 1)


def difference_rewards(board: Board, state: State, slot: Tensor, rules: Rules = PLANNING) -> Tensor:
    """Return what the worth would lose had one agent alone stayed, shape (B, n): for agents that choose at once.

    Parameters
    ----------
    state : State
        Before the step.
    slot : Tensor of int, shape (B, n)
        Where all agents go.

    References
    ----------
    Wolpert and Tumer (2001), doi:10.1142/S0219525901000188.
    """
    _, n, _ = board.shape
    gain, places = _gain(rules), board.places
    after = group_ability(board, slot)

    def share(chosen: Tensor) -> Tensor:
        one = torch.nn.functional.one_hot(pick(board.goal, chosen), places)
        return (one * pick(board.contribution, chosen)[..., None]).transpose(0, 1)

    without = after - share(slot) + share(state.slot)
    agents = torch.arange(n, device=slot.device).expand_as(slot)
    games = torch.arange(len(slot), device=slot.device)[:, None]
    further = _further(board, state, agents, slot, rules, games) * (slot != state.slot)
    cost = board.price[:, None] * further / board.crew[:, None]
    return gain(board, after)[:, None] - gain(board, without).transpose(0, 1) - cost


def _gain(rules: Rules) -> Callable[[Board, Tensor], Tensor]:
    return potential if rules.reward == Reward.MAKESPAN else coverage


def _further(
    board: Board, state: State, agent: Tensor, slot: Tensor, rules: Rules, rows: Tensor | None = None
) -> Tensor:
    """Return how much farther agents fly by going to a slot; all arguments of one shape, games in `rows`."""
    rows = torch.arange(len(agent), device=agent.device) if rows is None else rows
    if rules.flying:
        goal, at = board.goal[rows, agent, slot], state.at[rows, agent]
        flight = torch.where(at == board.places - 1, board.distance[rows, agent, slot], board.apart[rows, at, goal])
        return flight * (goal != board.places - 1)
    return board.distance[rows, agent, slot] - board.distance[rows, agent, state.slot[rows, agent]]


def time_over_reference(board: Board, group: Tensor) -> tuple[Tensor, Tensor]:
    """Return makespan of the served tasks over the reference makespan, and the number unserved, both of shape (B,)."""
    need, group = board.need[:, :-1], group[:, :-1]
    needed = need > 0
    empty = needed & (group <= 0)
    time = (need / group.clamp(min=DIVISOR)).masked_fill(~needed | empty, 0.0).amax(1)
    return time, empty.sum(1)
