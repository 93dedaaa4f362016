"""The replay buffer of PPO: trajectories of earlier policies, with the probabilities of the actions."""

from dataclasses import fields

import torch

from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.play.stored_games import from_stored, to_stored
from alloc.allocators.learned.play.trajectories import Trajectories
from alloc.problems.game import Board, State

_NESTED = ("board", "state")


class ReplayBuffer:
    """The latest trajectories, with up to `capacity` states in total; the oldest are dropped first.

    Whole trajectories are kept, as advantages are re-estimated along them at each use.
    """

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self._kept: list[Trajectories] = []

    def __len__(self) -> int:
        """Number of states."""
        return sum(one.evaluations for one in self._kept)

    def add(self, played: Trajectories) -> None:
        """Add a trajectory, if it does not exceed the capacity by itself."""
        self._kept.append(played)
        while self._kept and len(self) > self.capacity:
            self._kept.pop(0)

    def draw(self, generator: torch.Generator) -> Trajectories | None:
        """Return a random trajectory, or None if the buffer is empty."""
        if not self._kept:
            return None
        return self._kept[int(torch.randint(len(self._kept), (1,), generator=generator))]

    def state_dict(self) -> list[StateDict]:
        """Return all trajectories as dictionaries of tensors."""
        return [
            {
                **{field.name: getattr(one, field.name) for field in fields(Trajectories) if field.name not in _NESTED},
                "board": to_stored(one.board),
                "state": to_stored(one.state),
            }
            for one in self._kept
        ]

    def load_state_dict(self, state: list[StateDict]) -> None:
        """Restore what `state_dict` returned."""
        self._kept = [
            Trajectories(
                **{**one, "board": from_stored(Board, one["board"]), "state": from_stored(State, one["state"])}
            )
            for one in state
        ]
