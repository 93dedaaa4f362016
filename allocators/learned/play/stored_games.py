"""Boards, states and trajectories as dictionaries of tensors in checkpoints, with stable names."""

from collections.abc import Mapping
from dataclasses import fields
from typing import TypeVar

from torch import Tensor

from alloc.problems.game import Board, State

Stored = TypeVar("Stored", Board, State)

STORED_NAMES = {
    "candidates": "goal",
    "energy_weight": "price",
    "supply_ratio": "supply",
    "reachable_share": "choice",
    "task_distance": "apart",
    "visited": "left",
    "location": "at",
    "flown": "hopped",
}
"""Names in checkpoints of the fields of `Board`, `State` and `Transitions` whose names differ there."""


def to_stored(games: Board | State) -> dict[str, Tensor]:
    """Return the fields of a board or state, by their names in checkpoints."""
    return {stored_name(field.name): getattr(games, field.name) for field in fields(games)}


def from_stored(kind: type[Stored], stored: Mapping[str, Tensor]) -> Stored:
    """Return the board or state whose fields `to_stored` returned."""
    return kind(**{field.name: stored[stored_name(field.name)] for field in fields(kind)})


def stored_name(name: str) -> str:
    """Return the name of a field in checkpoints."""
    return STORED_NAMES.get(name, name)
