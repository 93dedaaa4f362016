"""Conversion of instances to a board; the only place where games are made dimensionless."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.problems.distances.metric import distance_table
from alloc.problems.game.board import SMALLEST, Board
from alloc.problems.game.candidates import candidate_tasks
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

MEAN_DISTANCE = 0.66
"""Mean to which distances are scaled; the mean distance of two points in the unit cube."""

LARGEST = 1e9
"""Cap on needs, distances and similar values, so that nothing overflows in single precision."""

SHORTEST_HOURS = 1e-300
"""Lower limit on the reference makespan in divisions."""

TIE_BREAK = 1e-9
"""Maximum random perturbation of distances to break ties between equally near tasks."""

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]
Number = TypeVar("Number", bound=np.generic)


@dataclass(frozen=True, eq=False)
class UnscaledGames:
    """B games with n agents, m tasks and c candidates per agent, in the units of the instances.

    Attributes
    ----------
    ability, speed, endurance : ndarray, shape (B, n)
        Ability 0 marks padding agents; endurance is the maximum distance on the battery.
    workload, priority : ndarray, shape (B, m)
    candidates : ndarray of int, shape (B, n, c)
        Place of each candidate, the last one m for idle.
    reachable : ndarray of bool, shape (B, n, c)
        Whether the candidate is in C(i).
    distance, cost : ndarray, shape (B, n, c)
        Distance from the agents' starts, and cost of the flight, see `Reach.costs`; 0 for idle.
    task_distance : ndarray, shape (B, m, m)
    hours, log_tau : ndarray, shape (B,)
        Reference makespan, and logarithm of tau of (3).
    """

    ability: Floats
    speed: Floats
    endurance: Floats
    workload: Floats
    priority: Floats
    candidates: Ints
    reachable: Flags
    distance: Floats
    cost: Floats
    task_distance: Floats
    hours: Floats
    log_tau: Floats

    @cached_property
    def unit(self) -> Floats:
        """Mean ability of the agents of each game, 1 without agents; shape (B,)."""
        unit = self.ability.sum(1) / np.maximum((self.ability > 0).sum(1), 1)
        return np.where(unit > 0, unit, 1.0)

    @cached_property
    def relative_ability(self) -> Floats:
        """Ability in mean abilities, shape (B, n)."""
        return self.ability / self.unit[:, None]

    @cached_property
    def contribution(self) -> Floats:
        """Ability that each agent contributes to its candidates, in mean abilities, shape (B, n, c)."""
        share = working_share(self.speed[..., None], self.distance, self.hours[:, None, None])
        return self.relative_ability[..., None] * share

    @cached_property
    def legal(self) -> Flags:
        """Whether an agent can go to a candidate and contribute there; always True for idle; shape (B, n, c)."""
        useful = _with_idle(self.workload > 0)
        games = np.arange(len(useful))[:, None, None]
        legal: Flags = self.reachable & useful[games, self.candidates] & (self.contribution > 0)
        legal[..., -1] = True
        return legal

    @property
    def nearest(self) -> Ints:
        """Slot of the nearest legal task of each agent, or idle if there is none; shape (B, n)."""
        return self.nearest_by(self.cost[..., :-1])

    def nearest_by(self, cost: Floats) -> Ints:
        """Return `nearest` with respect to the given costs of flights to tasks, shape (B, n, c - 1)."""
        legal = self.legal[..., :-1]
        slot: Ints = np.where(legal.any(2), np.where(legal, cost, np.inf).argmin(2), legal.shape[2])
        return slot

    def slots_at(self, chosen: Flags, otherwise: Ints | int) -> Ints:
        """Return the first legal slot with a flag, shape (B, n); flags have shape (B, n, c) or (B, n, c - 1)."""
        found = chosen & self.legal[..., : chosen.shape[2]]
        slot: Ints = np.where(found.any(2), found.argmax(2), otherwise)
        return slot

    def board(self, scale: Floats, start: Ints, energy_weight: Sequence[float] | Floats) -> Board:
        """Return the dimensionless games.

        Parameters
        ----------
        scale : ndarray, shape (B,)
            Factor on distances.
        start : ndarray of int, shape (B, n)
            Initial slot of each agent.
        energy_weight : sequence of float
            Weight of energy in the reward, by game.
        """
        with np.errstate(over="ignore"):
            need = np.minimum(self.workload / self.hours[:, None] / self.unit[:, None], LARGEST)
        numbers = {
            "ability": self.relative_ability,
            "need": _with_idle(need),
            "weight": _with_idle(_weights(self.priority, self.workload > 0)),
            "distance": _scaled(self.cost, scale[:, None, None]),
            "contribution": self.contribution,
            "energy_weight": np.asarray(energy_weight, dtype=np.float64),
            "supply_ratio": self._supply_ratio(need),
            "reachable_share": self.legal.mean(2),
            "task_distance": _with_idle(_scaled(self.task_distance, scale[:, None, None]), axes=2),
            "endurance": _scaled_endurance(self.endurance, scale[:, None]),
            "log_tau": np.maximum(self.log_tau * self.unit, -LARGEST),
        }
        tensors = {name: torch.from_numpy(array.astype(np.float32, copy=False)) for name, array in numbers.items()}
        return Board(
            **tensors,
            candidates=torch.from_numpy(self.candidates),
            legal=torch.from_numpy(self.legal),
            start=torch.from_numpy(start),
            scale=torch.from_numpy(scale),
        )

    def _supply_ratio(self, need: Floats) -> Floats:
        """See `Board.supply_ratio`."""
        batch, places = len(need), need.shape[1] + 1
        place = self.candidates + places * np.arange(batch)[:, None, None]
        able = np.bincount(place.ravel(), (self.contribution * self.legal).ravel(), batch * places)
        able = able.reshape(batch, places)[:, :-1]
        return _with_idle(np.log(np.maximum(able, SMALLEST) / np.maximum(need, SMALLEST)) / 2 - 1)


def make_board(
    instances: Sequence[Instance],
    reference_makespan: Sequence[float],
    energy_weight: Sequence[float],
    rng: np.random.Generator,
    *,
    near: int | None = None,
    plan: Ints | None = None,
) -> Board:
    """Return a board of games on `instances`, which must have equal numbers of agents and tasks.

    Agents start at their start task, or else at the nearest task in their reach, or else idle.

    Parameters
    ----------
    instances : sequence of Instance
    reference_makespan : sequence of float
        Makespan in hours for which needs are computed, such as a lower bound.
    energy_weight : sequence of float
        Weight of energy in each game.
    rng : numpy Generator
        Breaks ties between equally near tasks.
    near : int, optional
        Number of candidates per agent besides idle; by default all tasks.
    plan : ndarray of int, shape (n,), optional
        Initial task of the agents of all games instead; `IDLE` for idle.
    """
    games = _unscaled(instances, reference_makespan, near, plan)
    cost, legal = games.cost[..., :-1], games.legal[..., :-1]
    scale = np.array([_scale(one[able]) for one, able in zip(cost, legal, strict=True)])
    nearest = games.nearest_by(cost + TIE_BREAK * rng.random(cost.shape))
    wanted = _stack([one.start_task if plan is None else np.where(plan == IDLE, one.m, plan) for one in instances])
    start = games.slots_at(games.candidates == wanted[..., None], otherwise=nearest)
    return games.board(scale, start, energy_weight)


def _unscaled(
    instances: Sequence[Instance], hours: Sequence[float], near: int | None, plan: Ints | None
) -> UnscaledGames:
    candidates, distance, cost, reachable = zip(*(candidate_tasks(one, near, plan) for one in instances), strict=True)
    return UnscaledGames(
        ability=_stack([one.ability for one in instances]),
        speed=_stack([one.speed for one in instances]),
        endurance=_stack([_endurance(one) for one in instances]),
        workload=_stack([one.workload for one in instances]),
        priority=_stack([one.priority for one in instances]),
        candidates=_stack(candidates),
        reachable=_stack(reachable),
        distance=_stack(distance),
        cost=_stack(cost),
        task_distance=_stack([distance_table(one.reach.goal, one.reach.goal) for one in instances]),
        hours=np.array([max(reference, SHORTEST_HOURS) for _, reference in zip(instances, hours, strict=True)]),
        log_tau=np.array([math.log(one.tau) for one in instances]),
    )


def _stack(arrays: Sequence[NDArray[Number]]) -> NDArray[Number]:
    """Stack arrays along a new first axis, without a copy if there is only one."""
    return arrays[0][None] if len(arrays) == 1 else np.stack(arrays)


def _with_idle(array: NDArray[Number], axes: int = 1) -> NDArray[Number]:
    """Append idle, with value 0, to each of the last `axes` axes."""
    return np.pad(array, [(0, 0)] * (array.ndim - axes) + [(0, 1)] * axes)


def working_share(speed: Floats, distance: Floats, hours: float | Floats) -> Floats:
    """Return the share of the reference makespan left for work after the flight; arguments broadcast."""
    if not np.isfinite(speed).any():
        return np.ones_like(distance)
    with np.errstate(over="ignore"):
        return np.clip(1 - distance / speed / np.maximum(hours, SHORTEST_HOURS), 0.0, 1.0)


def _scale(distance: Floats) -> float:
    """Return the factor that scales the mean of these distances to `MEAN_DISTANCE`."""
    farthest = float(distance.max(initial=0.0))
    if farthest == 0:
        return 1.0
    with np.errstate(over="ignore", under="ignore"):
        scale = MEAN_DISTANCE / float((distance / farthest).mean()) / farthest
    return float(np.clip(scale, 1e-300, 1e300))


def _scaled(distance: Floats, scale: Floats) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        return np.minimum(distance * scale, LARGEST).astype(np.float32)


def _endurance(instance: Instance) -> Floats:
    """Return the maximum distance on each battery, shape (n,); NaN for an empty battery that is not used."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return instance.battery / instance.reach.energy_per_distance


def _scaled_endurance(endurance: Floats, scale: Floats) -> Floats:
    with np.errstate(over="ignore"):
        lasts = endurance * scale
    return np.where(np.isnan(lasts) | (lasts > LARGEST), np.inf, lasts)


def _weights(priority: Floats, useful: Flags) -> Floats:
    """Return priorities divided by their mean over tasks with workload, per game; 1 if all are 0; shape (B, m)."""
    priority = np.where(useful, priority, 0.0)
    highest = priority.max(1, keepdims=True)
    priority = np.where(highest > 0, priority / np.where(highest > 0, highest, 1.0), useful)
    mean = priority.sum(1, keepdims=True) / np.maximum(useful.sum(1, keepdims=True), 1)
    return priority / np.where(mean > 0, mean, 1.0)
