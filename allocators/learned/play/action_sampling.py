"""Sampling of actions from scores, and their log-probabilities: by bidding, and by simultaneous choice."""

import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import Scores
from alloc.problems.game import (
    PLANNING,
    Board,
    Rules,
    State,
    TurnRule,
    action_mask,
    apply_moves,
    at_slot,
    current_tasks,
    grant_bids,
)

MASKED = -torch.inf


def sample_actions(
    board: Board,
    state: State,
    scores: Scores,
    rules: Rules = PLANNING,
    temperature: float = 0.0,
    generator: torch.Generator | None = None,
) -> tuple[Tensor, Tensor]:
    """Draw the actions of a step.

    With Gumbel noise on the scores, granting bids in order of score draws them successively from the softmax over all
    bids that share no task with previous ones (a Plackett-Luce model). Agents that choose simultaneously each draw from
    their own softmax, in which staying has the score 0.

    Parameters
    ----------
    temperature : float
        Scores are divided by it; 0 selects the best.

    Returns
    -------
    actions : Tensor of int, shape (B, k)
        ``agent * c + slot`` of each move in its order; -1 and ``n * c`` as `grant_bids` says.
    slot : Tensor of int, shape (B, n)
        Candidate that each agent goes to.

    References
    ----------
    Kool, van Hoof and Welling (2019), arXiv:1903.06059, for the draws by Gumbel noise.
    """
    bids, reserve = scores.bids, scores.reserve
    if rules.turn == TurnRule.SIMULTANEOUS:
        bids = _with_staying(board, state, bids, rules)
    else:
        bids = bids.masked_fill(~action_mask(board, state, rules), MASKED)
    if temperature > 0:
        bids = bids / temperature + _gumbel(bids, generator)
        reserve = reserve / temperature + _gumbel(reserve, generator)
    if rules.turn == TurnRule.SIMULTANEOUS:
        slot = bids.argmax(2)
        agents = torch.arange(board.shape[1], device=slot.device)
        return (agents * board.shape[2] + slot).masked_fill(state.done[:, None], -1), slot
    actions = grant_bids(board, state, bids, reserve, rules.most_moves)
    return actions, apply_moves(board, state, actions)


def _gumbel(like: Tensor, generator: torch.Generator | None) -> Tensor:
    return -torch.empty_like(like).exponential_(generator=generator).clamp(min=1e-30).log()


def _with_staying(board: Board, state: State, bids: Tensor, rules: Rules) -> Tensor:
    bids = bids.masked_fill(~action_mask(board, state, rules), MASKED)
    return bids.scatter(2, state.slot[..., None], 0.0)


def log_probabilities(
    board: Board, state: State, scores: Scores, actions: Tensor, rules: Rules = PLANNING
) -> tuple[Tensor, Tensor]:
    """Return the log-probability of each action given those before it, and the mean entropy of a draw.

    Parameters
    ----------
    actions : Tensor of int, shape (B, k)
        As `sample_actions` returns them.

    Returns
    -------
    log_probability : Tensor, shape (B, k)
        0 where the action is -1.
    entropy : Tensor, shape (B,)
        Entropy of the first draw if agents bid, or the mean over agents if they choose simultaneously.
    """
    if rules.turn == TurnRule.SIMULTANEOUS:
        logits = _with_staying(board, state, scores.bids, rules).log_softmax(2)
        chosen = at_slot(logits, actions.clamp(min=0) % board.shape[2])
        entropy = -(logits.exp() * logits.masked_fill(logits == MASKED, 0.0)).sum(2).mean(1)
        return chosen.masked_fill(actions < 0, 0.0), entropy
    return _of_bids(board, state, scores, actions, rules)


def _of_bids(board: Board, state: State, scores: Scores, actions: Tensor, rules: Rules) -> tuple[Tensor, Tensor]:
    batch, n, c = board.shape
    rows, idle = torch.arange(batch, device=actions.device), board.places - 1
    task = current_tasks(board, state)
    bids = scores.bids.masked_fill(~action_mask(board, state, rules), MASKED)
    result = []
    entropy = torch.zeros_like(scores.reserve)
    for number, action in enumerate(actions.unbind(1)):
        logits = torch.cat([bids.flatten(1), scores.reserve[:, None]], 1)
        total = logits.logsumexp(1)
        if number == 0:
            shares = (logits - total[:, None]).exp()
            entropy = total - (shares * logits.masked_fill(logits == MASKED, 0.0)).sum(1)
        taken = action.clamp(min=0)
        result.append((logits[rows, taken] - total).masked_fill(action < 0, 0.0))
        if number + 1 < actions.shape[1]:
            real = (action >= 0) & (action < n * c)
            agent, slot = torch.div(taken, c, rounding_mode="floor").clamp(max=n - 1), taken % c
            source, target = task[rows, agent], board.candidates[rows, agent, slot]
            source = source.masked_fill(~real | (source == idle), -1)[:, None]
            target = target.masked_fill(~real | (target == idle), -1)[:, None]
            shut = ((task == source) | (task == target))[..., None]
            shut = shut | (board.candidates == source[..., None]) | (board.candidates == target[..., None])
            shut[rows, agent] |= real[:, None]
            bids = bids.masked_fill(shut, MASKED)
    return torch.stack(result, 1), entropy
