"""From scores to moves, and how probable moves were: for agents that bid, and for agents that choose at once."""

import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import Scores
from alloc.problems.game import PLANNING, Board, Rules, State, Turn, grant, moved, open_bids, pick, tasks_of

BARRED = -torch.inf


def choose(
    board: Board,
    state: State,
    scores: Scores,
    rules: Rules = PLANNING,
    temperature: float = 0.0,
    generator: torch.Generator | None = None,
) -> tuple[Tensor, Tensor]:
    """Draw what is to be done.

    With Gumbel noise on the scores, granting bids in their order draws them one after the other from the softmax over
    all that share no task with those before (a Plackett-Luce model); agents that choose at once each draw from a
    softmax of their own, in which staying scores 0.

    Parameters
    ----------
    temperature : float
        What scores are divided by; 0 takes the best.

    Returns
    -------
    actions : Tensor of int, shape (B, k)
        ``agent * c + slot`` of each move in its order; -1 and ``n * c`` as `grant` says.
    slot : Tensor of int, shape (B, n)
        Where all agents go.

    References
    ----------
    Kool, van Hoof and Welling (2019), arXiv:1903.06059, for the draws by Gumbel noise.
    """
    bids, reserve = scores.bids, scores.reserve
    if rules.turn == Turn.SIMULTANEOUS:
        bids = _with_staying(board, state, bids, rules)
    else:
        bids = bids.masked_fill(~open_bids(board, state, rules), BARRED)
    if temperature > 0:
        bids = bids / temperature + _gumbel(bids, generator)
        reserve = reserve / temperature + _gumbel(reserve, generator)
    if rules.turn == Turn.SIMULTANEOUS:
        slot = bids.argmax(2)
        agents = torch.arange(board.shape[1], device=slot.device)
        return (agents * board.shape[2] + slot).masked_fill(state.done[:, None], -1), slot
    actions = grant(board, state, bids, reserve, rules.most_moves)
    return actions, moved(board, state, actions)


def _gumbel(like: Tensor, generator: torch.Generator | None) -> Tensor:
    return -torch.empty_like(like).exponential_(generator=generator).clamp(min=1e-30).log()


def _with_staying(board: Board, state: State, bids: Tensor, rules: Rules) -> Tensor:
    bids = bids.masked_fill(~open_bids(board, state, rules), BARRED)
    return bids.scatter(2, state.slot[..., None], 0.0)


def log_probabilities(
    board: Board, state: State, scores: Scores, actions: Tensor, rules: Rules = PLANNING
) -> tuple[Tensor, Tensor]:
    """Return the log-probability of each action given those before it, and the mean entropy of a draw.

    Parameters
    ----------
    actions : Tensor of int, shape (B, k)
        As `choose` returns them.

    Returns
    -------
    log_probability : Tensor, shape (B, k)
        0 where the action is -1.
    entropy : Tensor, shape (B,)
        Of the first draw where agents bid, of the mean agent where they choose at once.
    """
    if rules.turn == Turn.SIMULTANEOUS:
        logits = _with_staying(board, state, scores.bids, rules).log_softmax(2)
        chosen = pick(logits, actions.clamp(min=0) % board.shape[2])
        entropy = -(logits.exp() * logits.masked_fill(logits == BARRED, 0.0)).sum(2).mean(1)
        return chosen.masked_fill(actions < 0, 0.0), entropy
    return _of_bids(board, state, scores, actions, rules)


def _of_bids(board: Board, state: State, scores: Scores, actions: Tensor, rules: Rules) -> tuple[Tensor, Tensor]:
    batch, n, c = board.shape
    rows, idle = torch.arange(batch, device=actions.device), board.places - 1
    task = tasks_of(board, state)
    bids = scores.bids.masked_fill(~open_bids(board, state, rules), BARRED)
    result = []
    entropy = torch.zeros_like(scores.reserve)
    for number, action in enumerate(actions.unbind(1)):
        logits = torch.cat([bids.flatten(1), scores.reserve[:, None]], 1)
        total = logits.logsumexp(1)
        if number == 0:
            shares = (logits - total[:, None]).exp()
            entropy = total - (shares * logits.masked_fill(logits == BARRED, 0.0)).sum(1)
        taken = action.clamp(min=0)
        result.append((logits[rows, taken] - total).masked_fill(action < 0, 0.0))
        if number + 1 < actions.shape[1]:
            real = (action >= 0) & (action < n * c)
            agent, slot = torch.div(taken, c, rounding_mode="floor").clamp(max=n - 1), taken % c
            source, target = task[rows, agent], board.goal[rows, agent, slot]
            source = source.masked_fill(~real | (source == idle), -1)[:, None]
            target = target.masked_fill(~real | (target == idle), -1)[:, None]
            shut = ((task == source) | (task == target))[..., None]
            shut = shut | (board.goal == source[..., None]) | (board.goal == target[..., None])
            shut[rows, agent] |= real[:, None]
            bids = bids.masked_fill(shut, BARRED)
    return torch.stack(result, 1), entropy
