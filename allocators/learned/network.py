"""The actor-critic: attention over tasks, and a small network that scores each agent's bid for each task."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from alloc.problems.game import (
    PAIR_FEATURES,
    TASK_FEATURES,
    Board,
    State,
    illegal_actions,
    observe_pairs,
    observe_tasks,
)

BARRED = -1e9
"""Logit of an action that may not be chosen."""


@dataclass(frozen=True)
class NetworkSize:
    """Sizes of an `ActorCritic`; part of every stored policy."""

    pair_width: int = 32
    task_width: int = 32
    heads: int = 4


class ActorCritic(nn.Module):
    """Scores bids (the actor, (7)) and states (the critic, (8)) for any number of agents and tasks.

    The logit of a bid is the sum of two parts. The local part sees the pair of agent and task alone, so that after a
    move only the pairs that it touched are scored anew. The other part, a pointer, compares the agent's group with
    the task after the tasks attended to each other; it is cheap enough to be computed anew at each step.

    References
    ----------
    Fang et al. (2025), section 2.2; Vaswani et al. (2017), arXiv:1706.03762; the pointer as in Kool, van Hoof and
    Welling (2019), arXiv:1803.08475.
    """

    def __init__(self, size: NetworkSize | None = None) -> None:
        super().__init__()
        self.size = size or NetworkSize()
        wide, width = self.size.pair_width, self.size.task_width
        self.local = nn.Sequential(
            nn.Linear(PAIR_FEATURES, wide), nn.ReLU(), nn.Linear(wide, wide), nn.ReLU(), nn.Linear(wide, 1)
        )
        self.embed = nn.Linear(TASK_FEATURES, width)
        self.attend = nn.MultiheadAttention(width, self.size.heads, batch_first=True)
        self.mix = nn.Sequential(nn.Linear(width, 2 * width), nn.ReLU(), nn.Linear(2 * width, width))
        self.query, self.key = nn.Linear(width + 1, width), nn.Linear(width, width)
        self.stop = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, 1))
        self.critic = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, 1))

    def tasks(self, features: Tensor) -> Tensor:
        """Let the tasks attend to each other: (B, m + 1, TASK_FEATURES) to (B, m + 1, width)."""
        token = torch.relu(self.embed(features))
        token = token + self.attend(token, token, token, need_weights=False)[0]
        token = token + self.mix(token)
        return nn.functional.layer_norm(token, list(token.shape[-1:]))

    def pointer(self, token: Tensor, task: Tensor, ability: Tensor) -> Tensor:
        """Compare each agent's group with each task: shape (B, n, m + 1)."""
        group = token.gather(1, task[..., None].expand(-1, -1, token.shape[2]))
        query = self.query(torch.cat([group, ability[..., None] - 1], -1))
        likeness: Tensor = query @ self.key(token).transpose(1, 2)
        return likeness.div(token.shape[2] ** 0.5)

    def heads(self, token: Tensor) -> tuple[Tensor, Tensor]:
        """Return the logit of stopping and the value of the state, both of shape (B,)."""
        pooled = torch.cat([token.mean(1), token.amax(1)], -1)
        return self.stop(pooled)[:, 0], self.critic(pooled)[:, 0]

    def forward(self, board: Board, state: State) -> tuple[Tensor, Tensor]:
        """Return the logits of all actions, shape (B, n * (m + 1) + 1), and the values, shape (B,)."""
        token = self.tasks(observe_tasks(board, state))
        bid = self.local(observe_pairs(board, state))[..., 0] + self.pointer(token, state.task, board.ability)
        stop, value = self.heads(token)
        logits = torch.cat([bid.flatten(1), stop[:, None]], 1)
        return logits.masked_fill(illegal_actions(board, state), BARRED), value
