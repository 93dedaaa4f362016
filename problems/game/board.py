"""The board: what stays fixed in a batch of games, as tensors without units."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

SMALLEST = 1e-3
"""Smallest ability, need or supply that is divided by or taken the logarithm of, in mean abilities."""

AGENT_FIELDS = ("ability", "candidates", "legal", "distance", "contribution", "start", "reachable_share", "endurance")
"""Fields of `Board` that have a row for each agent."""


@dataclass(frozen=True, eq=False)
class Board:
    """B games with n agents, m tasks and c candidates per agent; place m is that of the idle.

    Abilities are in units of the instance's mean, distances are scaled to the mean `layout.MEAN_DISTANCE`.

    Attributes
    ----------
    ability : Tensor, shape (B, n)
        0 for agents that only fill a game up.
    need : Tensor, shape (B, m + 1)
        Ability that each task needs to be done at the reference makespan; 0 for none, and at the place of the idle.
    weight : Tensor, shape (B, m + 1)
        Priority over the mean priority of the tasks that need anything.
    candidates : Tensor of int, shape (B, n, c)
        Place of each candidate; the last one is the place of the idle.
    legal : Tensor of bool, shape (B, n, c)
        Which candidates an agent can take, its C(i); being idle always is one.
    distance : Tensor, shape (B, n, c)
        From each agent's start to its candidates (1).
    contribution : Tensor, shape (B, n, c)
        Ability that an agent brings to a candidate: less than its own where it arrives late.
    start : Tensor of int, shape (B, n)
        The candidate where each agent is when the game begins.
    energy_weight : Tensor, shape (B,)
        Weight of energy in the reward.
    supply_ratio : Tensor, shape (B, m + 1)
        log of the ability that can reach each task over its need, halved, less 1: low where few can help; 0 for idle.
    reachable_share : Tensor, shape (B, n)
        Share of its candidates that each agent can take.
    task_distance : Tensor, shape (B, m + 1, m + 1)
        Distance between tasks; 0 to and from the place of the idle.
    endurance : Tensor, shape (B, n)
        Distance for which each battery lasts; ``inf`` without one.
    log_tau : Tensor, shape (B,)
        Logarithm of the discount factor of (3) times the mean ability: tau itself may be too small for a float.
    scale : Tensor of double, shape (B,)
        What the distances of the instance were multiplied by.
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
        """Number of tasks and 1."""
        return self.need.shape[1]

    @property
    def agent_count(self) -> Tensor:
        """Number of agents in each game, shape (B,): without those that only fill it up and have no ability."""
        return (self.ability > 0).sum(1).clamp(min=1)

    @property
    def log_need(self) -> Tensor:
        """Logarithm of the needs, or of `SMALLEST`, shape (B, m + 1)."""
        return self.need.clamp(min=SMALLEST).log()

    def __getitem__(self, rows: Tensor) -> Board:
        """Return the games with these numbers."""
        return Board(*(getattr(self, field.name)[rows] for field in fields(self)))

    def of_agents(self, some: slice) -> Board:
        """Return the same games with some of the agents, for the features of these alone."""
        return replace(self, **{name: getattr(self, name)[:, some] for name in AGENT_FIELDS})

    def to(self, device: torch.device | str) -> Board:
        """Return the same board on another device."""
        return Board(*(getattr(self, field.name).to(device) for field in fields(self)))
