"""The board: constants of a batch of games, as dimensionless tensors."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

SMALLEST = 1e-3
"""Lower limit on abilities, needs and supplies in divisions and logarithms, in mean abilities."""

AGENT_FIELDS = ("ability", "candidates", "legal", "distance", "contribution", "start", "reachable_share", "endurance")
"""Fields of `Board` with a row per agent."""


@dataclass(frozen=True, eq=False)
class Board:
    """B games with n agents, m tasks and c candidates per agent; place m stands for idle.

    Abilities are in units of the instance's mean, distances are scaled to the mean `layout.MEAN_DISTANCE`.

    Attributes
    ----------
    ability : Tensor, shape (B, n)
        0 for padding agents.
    need : Tensor, shape (B, m + 1)
        Ability that each task needs to be done by the reference makespan; 0 without workload and for idle.
    weight : Tensor, shape (B, m + 1)
        Priority divided by the mean priority of the tasks with a need.
    candidates : Tensor of int, shape (B, n, c)
        Place of each candidate; the last one is idle.
    legal : Tensor of bool, shape (B, n, c)
        Which candidates an agent can take, its C(i); idle is always legal.
    distance : Tensor, shape (B, n, c)
        From each agent's start to its candidates (1).
    contribution : Tensor, shape (B, n, c)
        Ability that an agent contributes to a candidate, less than its own if it arrives late.
    start : Tensor of int, shape (B, n)
        The candidate where each agent is at the start of the game.
    energy_weight : Tensor, shape (B,)
        Weight of energy in the reward.
    supply_ratio : Tensor, shape (B, m + 1)
        log(ability in reach of each task / its need) / 2 - 1: low if few agents can help; 0 for idle.
    reachable_share : Tensor, shape (B, n)
        Share of its candidates that each agent can take.
    task_distance : Tensor, shape (B, m + 1, m + 1)
        Distance between tasks; 0 to and from idle.
    endurance : Tensor, shape (B, n)
        Maximum distance on each battery; ``inf`` without a battery.
    log_tau : Tensor, shape (B,)
        Logarithm of tau of (3) times the mean ability; tau in these units may underflow.
    scale : Tensor of double, shape (B,)
        Factor by which the distances of the instance were multiplied.
    """

    ability: Tensor
    need: Tensor
    weight: Tensor
    candidates: Tensor
    legal: Tensor
    distance: Tensor
    contribution: Tensor
    start: Tensor
    energy_weight: Tensor
    supply_ratio: Tensor
    reachable_share: Tensor
    task_distance: Tensor
    endurance: Tensor
    log_tau: Tensor
    scale: Tensor

    @property
    def shape(self) -> tuple[int, int, int]:
        """B, n and c."""
        return self.legal.shape[0], self.legal.shape[1], self.legal.shape[2]

    @property
    def places(self) -> int:
        """Number of places, m + 1."""
        return self.need.shape[1]

    @property
    def agent_count(self) -> Tensor:
        """Number of agents in each game without padding, shape (B,)."""
        return (self.ability > 0).sum(1).clamp(min=1)

    @property
    def log_need(self) -> Tensor:
        """Logarithm of the needs, at least that of `SMALLEST`, shape (B, m + 1)."""
        return self.need.clamp(min=SMALLEST).log()

    def __getitem__(self, rows: Tensor) -> Board:
        """Return the games with the given indices."""
        return Board(*(getattr(self, field.name)[rows] for field in fields(self)))

    def of_agents(self, some: slice) -> Board:
        """Return the games with a slice of the agents, to compute features for these only."""
        return replace(self, **{name: getattr(self, name)[:, some] for name in AGENT_FIELDS})

    def to(self, device: torch.device | str) -> Board:
        """Return the board on another device."""
        return Board(*(getattr(self, field.name).to(device) for field in fields(self)))
