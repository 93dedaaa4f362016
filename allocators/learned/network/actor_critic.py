"""The network architecture of all methods: attention over groups and tasks, and a small network that scores bids."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor, nn

from alloc.problems.game import (
    AGENT_FEATURES,
    PAIR_FEATURES,
    TASK_FEATURES,
    Board,
    State,
    current_tasks,
    observe_agents,
    observe_pairs,
    observe_tasks,
    sum_by_place,
)

SLOPES = (-2.0, 1.0)
"""Range of the initial values of the heads' distance parameters."""


@dataclass(frozen=True)
class NetworkSize:
    """Sizes of an `ActorCritic`; part of every stored policy.

    Attributes
    ----------
    pair_width, task_width, heads : int
    attention : bool
        Whether groups and tasks attend to each other.
    """

    pair_width: int = 32
    task_width: int = 32
    heads: int = 4
    attention: bool = True


class Scores(NamedTuple):
    """Scores of the bids in B states, and values of the states.

    Attributes
    ----------
    bids : Tensor, shape (B, n, c)
        Score of every bid, legal or not.
    reserve : Tensor, shape (B,)
        Score of granting no bid.
    value : Tensor, shape (B,)
        Value of the state (8).
    """

    bids: Tensor
    reserve: Tensor
    value: Tensor


class ActorCritic(nn.Module):
    """Scores bids (the actor, (7)) and states (the critic, (8)) for any number of agents and tasks.

    Each group attends to its members, and the places attend to each other, depending on distance: information from
    neighbours reaches an agent in two steps, at a cost of O(n + m^2) instead of O(n^2). The score of a bid is the sum
    of two parts. The local part depends only on the features of agent and candidate, so that after a move only affected
    pairs are scored again. The other, a pointer, compares the agent's group with the candidate's place.

    References
    ----------
    Fang et al. (2025), section 2.2; Vaswani et al. (2017), arXiv:1706.03762; the pointer as in Kool, van Hoof and
    Welling (2019), arXiv:1803.08475.
    """

    def __init__(self, size: NetworkSize | None = None) -> None:
        super().__init__()
        self.size = size or NetworkSize()
        wide, width, heads = self.size.pair_width, self.size.task_width, self.size.heads
        self.local = nn.Sequential(
            nn.Linear(PAIR_FEATURES, wide), nn.ReLU(), nn.Linear(wide, wide), nn.ReLU(), nn.Linear(wide, 1)
        )
        self.embed = nn.Linear(TASK_FEATURES, width)
        if self.size.attention:
            self.member = nn.Linear(AGENT_FEATURES, width + heads)
            self.gather = nn.Linear(width, width)
            self.attend = nn.Linear(width, 3 * width)
            self.spread = nn.Linear(width, width)
            self.nearness = nn.Parameter(torch.linspace(*SLOPES, heads))
        self.mix = nn.Sequential(nn.Linear(width, 2 * width), nn.ReLU(), nn.Linear(2 * width, width))
        self.query, self.key = nn.Linear(width + 1, width), nn.Linear(width, width)
        self.reserve = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, 1))
        self.critic = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), nn.Linear(width, 1))

    def forward(self, board: Board, state: State) -> Scores:
        """Score all bids and the state."""
        token = self.places(board, state)
        return Scores(self.pairs(observe_pairs(board, state)) + self.pointer(board, state, token), *self.heads(token))

    def pairs(self, features: Tensor) -> Tensor:
        """Return the local part of the scores: (..., PAIR_FEATURES) to (...)."""
        score: Tensor = self.local(features)[..., 0]
        return score

    def places(self, board: Board, state: State) -> Tensor:
        """Return an encoding of each place, its group and the other places, shape (B, m + 1, width)."""
        token = torch.relu(self.embed(observe_tasks(board, state)))
        if self.size.attention:
            token = token + self.gather(self._members(board, state))
            token = token + self.spread(self._neighbours(board, token))
        token = token + self.mix(token)
        return nn.functional.layer_norm(token, list(token.shape[-1:]))

    def _members(self, board: Board, state: State) -> Tensor:
        """Attention of each group over its members, a softmax over those at each place, shape (B, m + 1, width)."""
        heads, width = self.size.heads, self.size.task_width
        projected = self.member(observe_agents(board, state))
        weight = (8 * torch.tanh(projected[..., :heads] / 8)).exp() * (board.ability > 0)[..., None]
        values = torch.relu(projected[..., heads:]).unflatten(-1, (heads, width // heads)) * weight[..., None]
        total = sum_by_place(torch.cat([weight, values.flatten(2)], -1), current_tasks(board, state), board.places)
        shares = total[..., heads:].unflatten(-1, (heads, width // heads)) / (total[..., :heads, None] + 1e-6)
        mean: Tensor = shares.flatten(2)
        return mean

    def _neighbours(self, board: Board, token: Tensor) -> Tensor:
        """Attention of places over each other, falling with distance by a slope per head, shape (B, m + 1, width)."""
        heads, width = self.size.heads, self.size.task_width
        query, key, value = (
            one.unflatten(-1, (heads, width // heads)).transpose(1, 2) for one in self.attend(token).chunk(3, -1)
        )
        slope = nn.functional.softplus(self.nearness)[:, None, None]
        likeness = query @ key.transpose(2, 3) / (width // heads) ** 0.5 - slope * board.task_distance[:, None]
        attended: Tensor = likeness.softmax(-1) @ value
        return attended.transpose(1, 2).flatten(2)

    def pointer(self, board: Board, state: State, token: Tensor) -> Tensor:
        """Return the pointer's part of the scores, shape (B, n, c)."""
        width = token.shape[2]
        group = token.gather(1, current_tasks(board, state)[..., None].expand(-1, -1, width))
        query = self.query(torch.cat([group, board.ability[..., None] - 1], -1))
        likeness = query @ self.key(token).transpose(1, 2) / width**0.5
        scores: Tensor = likeness if board.candidates.shape[2] == board.places else likeness.gather(2, board.candidates)
        return scores

    def heads(self, token: Tensor) -> tuple[Tensor, Tensor]:
        """Return the score of granting nothing and the value of the state, both of shape (B,)."""
        pooled = torch.cat([token.mean(1), token.amax(1)], -1)
        return self.reserve(pooled)[:, 0], self.critic(pooled)[:, 0]


def uninitialised(size: NetworkSize | None = None) -> ActorCritic:
    """Return a network in main memory with uninitialised weights; no random numbers are drawn."""
    with torch.device("meta"):
        network = ActorCritic(size)
    return network.to(torch.float32).to_empty(device="cpu")


def initialised(size: NetworkSize | None, seed: int, count: int) -> list[ActorCritic]:
    """Return networks with initial weights, drawn one after another from one stream of random numbers.

    The weights are the same as those that torch draws after `torch.manual_seed`, but the global generator is not
    affected.
    """
    generator = torch.Generator().manual_seed(seed)
    networks = [uninitialised(size) for _ in range(count)]
    for network in networks:
        for layer in network.modules():
            if isinstance(layer, nn.Linear):
                nn.init.kaiming_uniform_(layer.weight, a=math.sqrt(5), generator=generator)
                bound = 1 / math.sqrt(layer.in_features)
                nn.init.uniform_(layer.bias, -bound, bound, generator=generator)
        if network.size.attention:
            slopes = torch.linspace(*SLOPES, network.size.heads, dtype=torch.float32, device="cpu")
            network.nearness.data.copy_(slopes)
    return networks
