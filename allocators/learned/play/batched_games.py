"""Playing many games from different starts, in compiled loops or by torch."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.network.game_arrays import game_arrays
from alloc.allocators.learned.network.weights import weights_of
from alloc.allocators.learned.play.compiled_game import new_game, play_rounds, reset_game
from alloc.allocators.learned.play.limits import PLACES
from alloc.allocators.learned.play.rollout import Best, play
from alloc.problems import Instance
from alloc.problems.game import Board, make_board

SLICE = 50_000
"""Pairs times rounds that are played between two checks of the clock, about 5 to 25 ms."""


class Games(NamedTuple):
    """B games on the rows of a board.

    Attributes
    ----------
    row : ndarray of int, shape (B,)
    energy_weight : ndarray, shape (B,)
        Weight of energy.
    start : ndarray of int, shape (B, n)
        Candidate at which each agent starts.
    """

    row: NDArray[np.int64]
    energy_weight: NDArray[np.float64]
    start: NDArray[np.int64]


def play_games(
    network: ActorCritic,
    board: Board,
    games: Games,
    *,
    rounds: int,
    seed: int = 0,
    temperature: float = 0.0,
    total: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
) -> Best:
    """Play games and return the best position of each, in compiled loops, or by torch if the network is on a GPU.

    Parameters
    ----------
    network : ActorCritic
    board : Board
        A board in main memory.
    games : Games
        The games to play on it.
    rounds : int
        Maximum number of rounds.
    seed : int
        Seed of the draws.
    temperature, total, should_stop
        As for `rollout.play`; games not played due to a stop request count as infinitely bad, except the first.

    Returns
    -------
    Best
        The best positions, in main memory.
    """
    device = network.embed.weight.device
    if device.type == "cpu":
        return _play_compiled(network, board, games, rounds, seed, temperature, total, should_stop)
    row, energy_weight, start = (
        torch.from_numpy(array).to(device) for array in (games.row, games.energy_weight.astype(np.float32), games.start)
    )
    best = play(
        network,
        replace(board.to(device)[row], energy_weight=energy_weight, start=start),
        steps=rounds,
        temperature=temperature,
        generator=torch.Generator(device).manual_seed(seed),
        total=total,
        should_stop=should_stop,
    )
    return Best(*(getattr(best, field.name).cpu() for field in fields(Best)))


def _play_compiled(
    network: ActorCritic,
    board: Board,
    games: Games,
    rounds: int,
    seed: int,
    temperature: float,
    total: bool,
    should_stop: Callable[[], bool],
) -> Best:
    weights, boards = weights_of(network), game_arrays(board)
    count, (_, n, c) = len(games.row), board.shape
    random = np.random.default_rng(seed).integers(1, 2**63, (count, 1), dtype=np.uint64)
    best = games.start.astype(np.int32)
    figures = np.full((count, 3), np.inf)
    at_once = max(1, SLICE // (n * c + board.places**2 // PLACES))
    for number, row in enumerate(games.row.tolist()):
        if number and should_stop():
            break
        game = boards[row]._replace(energy_weight=float(games.energy_weight[number]))
        state = new_game(game, best[number], figures[number], random[number])
        reset_game(game, weights, state, total)
        for done in range(0, rounds, at_once):
            play_rounds(game, weights, state, min(at_once, rounds - done), temperature, total)
            if not state.running[0] or should_stop():
                break
    return Best(*(torch.from_numpy(part) for part in (best.astype(np.int64), *figures.T.copy())))


def warm_up(network: ActorCritic) -> None:
    """Call every compiled loop once, so that no run has to wait for compilation, or for a GPU to load its kernels."""
    instance = Instance(ability=[1.0, 2.0], workload=[1.0, 1.0], task_position=np.eye(2), start_task=[0, 1])
    board = make_board([instance], [1.0], [1.0], np.random.default_rng(0))
    games = Games(np.zeros(1, dtype=np.int64), np.ones(1), board.start.numpy())
    play_games(network, board, games, rounds=1, temperature=1.0)
