"""What stays fixed in a game: instances laid out as tensors, without units, side by side."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from alloc.problems.distances.metric import distance_table
from alloc.problems.game.candidates import near_tasks
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

MEAN_DISTANCE = 0.66
"""Distances are scaled to this mean, that of two points in the unit cube."""

LEAST = 1e-3
"""Least ability, need or supply that is divided by or taken the logarithm of, in mean abilities."""

LARGEST = 1e9
"""Needs, distances and the like beyond it are taken for it, so that nothing overflows in single precision."""


@dataclass(frozen=True, eq=False)
class Board:
    """B instances with n agents, m tasks and c candidates per agent; place m is that of the idle.

    Abilities are in units of the instance's mean, distances are scaled to the mean `MEAN_DISTANCE`.

    Attributes
    ----------
    ability : Tensor, shape (B, n)
    need : Tensor, shape (B, m + 1)
        Ability that each task needs to be done at the reference makespan; 0 for none, and at the place of the idle.
    weight : Tensor, shape (B, m + 1)
        Priority over the mean priority of the tasks that need anything.
    goal : Tensor of int, shape (B, n, c)
        Place of each candidate; the last one is the place of the idle.
    legal : Tensor of bool, shape (B, n, c)
        Which candidates an agent can take, its C(i); being idle always is one.
    distance : Tensor, shape (B, n, c)
        From each agent's start to its candidates (1).
    contribution : Tensor, shape (B, n, c)
        Ability that an agent brings to a candidate: less than its own where it arrives late.
    start : Tensor of int, shape (B, n)
        The candidate where each agent is when the game begins.
    price : Tensor, shape (B,)
        Weight of energy in the reward.
    supply : Tensor, shape (B, m + 1)
        log of the ability that can reach each task over its need, halved, less 1: low where few can help; 0 for idle.
    choice : Tensor, shape (B, n)
        Share of its candidates that each agent can take.
    apart : Tensor, shape (B, m + 1, m + 1)
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
    goal: Tensor
    legal: Tensor
    distance: Tensor
    contribution: Tensor
    start: Tensor
    price: Tensor
    supply: Tensor
    choice: Tensor
    apart: Tensor
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
    def crew(self) -> Tensor:
        """Number of agents in each game, shape (B,): without those that only fill it up and have no ability."""
        return (self.ability > 0).sum(1).clamp(min=1)

    def __getitem__(self, rows: Tensor) -> Board:
        """Return the games with these numbers."""
        return Board(*(getattr(self, field.name)[rows] for field in fields(self)))

    def to(self, device: torch.device | str) -> Board:
        """Return the same board on another device."""
        return Board(*(getattr(self, field.name).to(device) for field in fields(self)))


def make_board(
    instances: Sequence[Instance],
    reference_makespan: Sequence[float],
    price: Sequence[float],
    rng: np.random.Generator,
    *,
    near: int | None = None,
    plan: NDArray[np.int64] | None = None,
) -> Board:
    """Lay out games on `instances`, which must agree in numbers of agents and tasks.

    Agents begin at their start task, or else at the nearest task in their reach, or idle where there is none.

    Parameters
    ----------
    instances : sequence of Instance
    reference_makespan : sequence of float
        Hours at which the needs are set, such as a lower bound on the makespan.
    price : sequence of float
        Weight of energy in each game.
    rng : numpy Generator
        Breaks ties between equally near tasks.
    near : int, optional
        Candidates per agent besides being idle; all tasks by default.
    plan : ndarray of int, shape (n,), optional
        Where the agents of all games begin instead; `IDLE` for idle.
    """
    pairs = zip(instances, reference_makespan, strict=True)
    layouts = [_layout(instance, hours, rng, near, plan) for instance, hours in pairs]
    columns = [np.stack(column) for column in zip(*layouts, strict=True)]
    tensors = [torch.from_numpy(column) for column in columns]
    names = [field.name for field in fields(Board) if field.name != "price"]
    return Board(price=torch.tensor(price, dtype=torch.float32), **dict(zip(names, tensors, strict=True)))


def _layout(
    instance: Instance, hours: float, rng: np.random.Generator, near: int | None, plan: NDArray[np.int64] | None
) -> tuple[NDArray[np.generic], ...]:
    """Return the fields of `Board` for one instance, in their order and without the price."""
    m, hours = instance.m, max(hours, 1e-300)
    useful = np.append(instance.workload > 0, True)
    unit = float(np.mean(instance.ability))
    goal, distance, legal = near_tasks(instance, near, plan)
    contribution = instance.ability[:, None] / unit * working_share(instance.speed[:, None], distance, hours)
    legal &= useful[goal] & (contribution > 0)
    legal[:, -1] = True
    scale = _scale(distance[:, :-1][legal[:, :-1]])
    with np.errstate(over="ignore"):
        need = np.append(np.minimum(instance.workload / hours / unit, LARGEST), 0.0)
    reachable = np.bincount(goal.ravel(), (contribution * legal).ravel(), m + 1)
    supply = np.log(np.maximum(reachable, LEAST) / np.maximum(need, LEAST)) / 2 - 1
    supply[-1] = 0.0
    return (
        single(instance.ability / unit),
        single(need),
        single(_weight(instance)),
        goal,
        legal,
        scaled(distance, scale),
        single(contribution),
        _start(instance, goal, distance, legal, rng, plan),
        single(supply),
        single(legal.mean(axis=1)),
        scaled(_apart(instance), scale),
        _endurance(instance, scale),
        single(np.array(max(math.log(instance.tau) * unit, -LARGEST))),
        np.array(scale),
    )


def single(array: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return numbers in single precision."""
    return array.astype(np.float32)


def _scale(distance: NDArray[np.float64]) -> float:
    """Return what these distances are multiplied by, so that their mean is `MEAN_DISTANCE`."""
    farthest = float(distance.max(initial=0.0))
    if farthest == 0:
        return 1.0
    with np.errstate(over="ignore", under="ignore"):
        scale = MEAN_DISTANCE / float((distance / farthest).mean()) / farthest
    return float(np.clip(scale, 1e-300, 1e300))


def scaled(distance: NDArray[np.float64], scale: float | NDArray[np.float64]) -> NDArray[np.float32]:
    """Return distances in the units of a game."""
    with np.errstate(over="ignore"):
        return single(np.minimum(distance * scale, LARGEST))


def _weight(instance: Instance) -> NDArray[np.float64]:
    """Priority over its mean among the tasks with workload, shape (m + 1,); 1 where no task has any."""
    useful = instance.workload > 0
    priority = np.where(useful, instance.priority, 0.0)
    highest = priority.max()
    if highest == 0:
        return np.append(useful.astype(float), 0.0)
    priority /= highest
    return np.append(priority / priority[useful].mean(), 0.0)


def working_share(speed: NDArray[np.float64], distance: NDArray[np.float64], hours: float) -> NDArray[np.float64]:
    """Return the share of the reference makespan that is left to work after the flight, in the common shape."""
    if not np.isfinite(speed).any():
        return np.ones_like(distance)
    with np.errstate(over="ignore"):
        return np.clip(1 - distance / speed / max(hours, 1e-300), 0.0, 1.0)


def _start(
    instance: Instance,
    goal: NDArray[np.int64],
    distance: NDArray[np.float64],
    legal: NDArray[np.bool_],
    rng: np.random.Generator,
    plan: NDArray[np.int64] | None,
) -> NDArray[np.int64]:
    idle = legal.shape[1] - 1
    away = np.where(legal[:, :-1], distance[:, :-1] + 1e-9 * rng.random(distance[:, :-1].shape), np.inf)
    start = np.where(legal[:, :-1].any(axis=1), away.argmin(axis=1), idle)
    wanted = instance.start_task if plan is None else np.where(plan == IDLE, instance.m, plan)
    found = (goal == wanted[:, None]) & legal
    begins: NDArray[np.int64] = np.where(found.any(axis=1), found.argmax(axis=1), start)
    return begins


def _apart(instance: Instance) -> NDArray[np.float64]:
    m = instance.m
    apart = np.zeros((m + 1, m + 1))
    apart[:m, :m] = distance_table(instance.task_position, instance.task_position)
    return apart


def _endurance(instance: Instance, scale: float) -> NDArray[np.float32]:
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        lasts = instance.battery / instance.energy_per_distance * scale
        return single(np.where(np.isnan(lasts) | (lasts > LARGEST), np.inf, lasts))
