"""Playing many games from many beginnings: boards of torch as arrays of the compiled loops, and back."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.network.compiled import View, weights_of
from alloc.allocators.learned.play.compiled_game import Lane, begin_game, play_rounds
from alloc.allocators.learned.play.rollout import Best, play
from alloc.allocators.learned.search.limits import PLACES
from alloc.problems import Instance
from alloc.problems.game import Board, make_board
from alloc.problems.game.board import LEAST

SLICE = 200_000
"""Pairs times rounds that are played between two looks at the clock, some 20 to 100 ms."""


class Games(NamedTuple):
    """Games on the rows of a board.

    Attributes
    ----------
    row : ndarray of int, shape (B,)
    price : ndarray, shape (B,)
        Weight of energy.
    start : ndarray of int, shape (B, n)
        The candidate where each agent begins.
    """

    row: NDArray[np.int64]
    price: NDArray[np.float64]
    start: NDArray[np.int64]


def views_of(board: Board) -> list[View]:
    """Return the games of a board, without copies but for the places of candidates."""
    goal = board.goal.to(torch.int32).numpy()
    log_need = board.need.clamp(min=LEAST).log()
    columns = [
        tensor.numpy()
        for tensor in (
            board.ability,
            board.need,
            log_need,
            board.supply,
            board.choice,
            board.apart,
        )
    ]
    pairs = [tensor.numpy() for tensor in (board.legal, board.distance, board.contribution)]
    contiguous = [np.ascontiguousarray(array) for array in (*columns, goal, *pairs)]
    return [
        View._make([*(array[game] for array in contiguous), float(board.price[game])])
        for game in range(len(board.price))
    ]


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
    """Play games and return the best position of each: in compiled loops, or by torch where the network is elsewhere.

    Parameters
    ----------
    network : ActorCritic
    board : Board
        In main memory.
    games : Games
        What is played on it.
    rounds : int
        Most rounds.
    seed : int
        Of the draws.
    temperature, total, should_stop
        As for `rollout.play`; what is not played when it is time to stop counts as infinitely bad, but for the first.

    Returns
    -------
    Best
        In main memory.
    """
    device = network.embed.weight.device
    if device.type == "cpu":
        return _play_compiled(network, board, games, rounds, seed, temperature, total, should_stop)
    row, price, start = (
        torch.from_numpy(array).to(device) for array in (games.row, games.price.astype(np.float32), games.start)
    )
    lanes = replace(board.to(device)[row], price=price, start=start)
    generator = torch.Generator(device).manual_seed(seed)
    best = play(
        network,
        lanes,
        steps=rounds,
        temperature=temperature,
        generator=generator,
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
    weights, views = weights_of(network), views_of(board)
    count, (n, c) = len(games.row), views[0].legal.shape
    state = np.random.default_rng(seed).integers(1, 2**63, (count, 1), dtype=np.uint64)
    best = games.start.astype(np.int32)
    figures = np.full((count, 3), np.inf)
    at_once = max(1, SLICE // (n * c + len(views[0].need) ** 2 // PLACES))
    for game, row in enumerate(games.row.tolist()):
        if game and should_stop():
            break
        view = views[row]._replace(price=float(games.price[game]))
        lane = Lane(
            slot=best[game].copy(),
            left=np.zeros((n, c), dtype=np.bool_),
            local=np.zeros((n, c), dtype=np.float32),
            group=np.zeros(len(view.need), dtype=np.float32),
            best=best[game],
            figures=figures[game],
            random=state[game],
            going=np.zeros(1, dtype=np.bool_),
        )
        begin_game(view, weights, lane, total)
        for done in range(0, rounds, at_once):
            play_rounds(view, weights, lane, min(at_once, rounds - done), temperature, total)
            if not lane.going[0] or should_stop():
                break
    return Best(*(torch.from_numpy(part) for part in (best.astype(np.int64), *figures.T.copy())))


def warm_up(network: ActorCritic) -> None:
    """Call every compiled loop once, so that no run waits for the compiler, or for a GPU to load its kernels."""
    instance = Instance(ability=[1.0, 2.0], workload=[1.0, 1.0], task_position=np.eye(2), start_task=[0, 1])
    board = make_board([instance], [1.0], [1.0], np.random.default_rng(0))
    games = Games(np.zeros(1, dtype=np.int64), np.ones(1), board.start.numpy())
    play_games(network, board, games, rounds=1, temperature=1.0)
