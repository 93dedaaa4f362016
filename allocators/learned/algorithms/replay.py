"""The replay buffer: trajectories of older policies, with the probabilities by which they acted."""

from dataclasses import fields
from typing import Any

import torch

from alloc.allocators.learned.play.stored_games import from_stored, to_stored
from alloc.allocators.learned.play.trajectories import Trajectories
from alloc.problems.game import Board, State


class Replay:
    """The latest trajectories, up to `capacity` states in all; the oldest go first.

    Whole trajectories are kept, since advantages are anew estimated along them when they are used.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._kept: list[Trajectories] = []

    def __len__(self) -> int:
        """Number of states."""
        return sum(one.evaluations for one in self._kept)

    def add(self, played: Trajectories) -> None:
        """Keep a trajectory, if there is room for it at all."""
        self._kept.append(played)
        while self._kept and len(self) > self.capacity:
            self._kept.pop(0)

    def draw(self, generator: torch.Generator) -> Trajectories | None:
        """Return one of the trajectories, None from an empty buffer."""
        if not self._kept:
            return None
        return self._kept[int(torch.randint(len(self._kept), (1,), generator=generator))]

    def state(self) -> list[dict[str, Any]]:
        """Return all trajectories as dictionaries of tensors."""
        return [
            {
                **{field.name: getattr(one, field.name) for field in fields(Trajectories) if field.name not in _PARTS},
                "board": to_stored(one.board),
                "state": to_stored(one.state),
            }
            for one in self._kept
        ]

    def load(self, state: list[dict[str, Any]]) -> None:
        """Take up what `state` returned."""
        self._kept = [
            Trajectories(
                **{**one, "board": from_stored(Board, one["board"]), "state": from_stored(State, one["state"])}
            )
            for one in state
        ]


_PARTS = ("board", "state")
