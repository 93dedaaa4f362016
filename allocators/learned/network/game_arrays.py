"""Boards of torch as arrays of the compiled loops, without a copy but for the candidates."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.network.compiled_layers import Flags, Floats, Ints
from alloc.problems.game import Board


class GameArrays(NamedTuple):
    """One game: a row of each of these fields of `Board`.

    Attributes
    ----------
    ability, reachable_share : ndarray, shape (n,)
    need, log_need, supply_ratio : ndarray, shape (m + 1,)
    task_distance : ndarray, shape (m + 1, m + 1)
    candidates, legal, distance, contribution : ndarray, shape (n, c)
    energy_weight : float
    """

    ability: Floats
    need: Floats
    log_need: Floats
    supply_ratio: Floats
    reachable_share: Floats
    task_distance: Floats
    candidates: Ints
    legal: Flags
    distance: Floats
    contribution: Floats
    energy_weight: float


def game_arrays(board: Board) -> list[GameArrays]:
    """Return the games of a board in main memory."""
    fields = {name: getattr(board, name).numpy() for name in GameArrays._fields[:-1]}
    fields["candidates"] = fields["candidates"].astype(np.int32)  # loops over 64-bit numbers take a fifth longer
    columns = [np.ascontiguousarray(array) for array in fields.values()]
    weights = board.energy_weight.tolist()
    return [GameArrays._make([*(array[row] for array in columns), weights[row]]) for row in range(len(weights))]
