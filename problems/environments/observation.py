"""Observations of agents in the paper's game (section 2.2): itself, the tasks, and the occupancy within its range."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from alloc.problems.environments.episode import Game
from alloc.problems.game import State, current_tasks, hop_distance
from alloc.problems.game.rules import TOLERANCE

AGENT_FIGURES, TASK_FIGURES = 7, 9

LIMIT = 10.0
"""Observations are clipped to [-LIMIT, LIMIT]."""

Floats = NDArray[np.float32]


def observe(game: Game, state: State, share: float) -> tuple[Floats, Floats]:
    """Return observations of the agents themselves, shape (n, AGENT_FIGURES), and of tasks, shape (n, m, TASK_FIGURES).

    Parameters
    ----------
    share : float
        Share of the steps that have passed.
    """
    return _bounded(_itself(game, state, share)), _bounded(_tasks(game, state))


def _bounded(figures: Tensor) -> Floats:
    bounded: Floats = figures.clamp(-LIMIT, LIMIT).numpy()
    return bounded


def _itself(game: Game, state: State, share: float) -> Tensor:
    board, n = game.board, game.instance.n
    idle = (current_tasks(board, state)[0] == board.places - 1).float()
    battery = 1 - (state.flown[0] / board.endurance[0].clamp(min=TOLERANCE)).clamp(max=1.0)
    figures = torch.stack([battery, board.ability[0], idle, torch.full((n,), share)], 1)
    return torch.cat([torch.from_numpy(_position(game, state)), figures], 1)


def _position(game: Game, state: State) -> Floats:
    """Return scaled positions of agents relative to the mean of the tasks; 0 where unknown; shape (n, 3)."""
    instance, at = game.instance, state.location[0].numpy()
    known = instance.task_position[~np.isnan(instance.task_position[:, 0])]
    scale = game.board.scale.item()
    with np.errstate(over="ignore", invalid="ignore"):
        centre = (known * scale).mean(axis=0) if len(known) else np.zeros(3)
        places = np.vstack([instance.task_position, np.zeros((1, 3))])[at]
        places = np.where((at == instance.m)[:, None], instance.start_position, places)
        seen = np.clip(places * scale - centre, -LIMIT, LIMIT)
    return np.where(np.isnan(seen), 0.0, seen).astype(np.float32)


def _tasks(game: Game, state: State) -> Tensor:
    board, (_, n, c) = game.board, game.board.shape
    flight = hop_distance(board, state)[0, :, :-1]
    here = torch.nn.functional.one_hot(current_tasks(board, state)[0], c)[:, :-1].float()
    within = torch.from_numpy(game.instance.communication_range * board.scale.item()).float()[:, None] + TOLERANCE
    seen = torch.maximum((flight <= within).float(), here)
    need, group, members = board.need[0, :-1], state.group[0, :-1], here.sum(0)
    columns = [
        need.expand(n, -1),
        board.weight[0, :-1].expand(n, -1),
        flight,
        board.contribution[0, :, :-1],
        seen,
        seen * group,
        seen * members,
        seen * (need - group),
        here,
    ]
    return torch.stack(columns, 2)
