"""The Markov game of the paper (section 2.2), batched in torch: agents bid for moves, one bid a step is granted.

Every agent starts at its start task, or else at the nearest task in its reach. In each step every agent bids for
every task that it can take (its C(i)) and for being idle; one bid, or the end of the game, is chosen. Agents know
local figures only: deficits of their own group and of the other one, in units of their own ability, and distances.

States, not observations, are kept in trajectories: `observe` is a pure function of the two dataclasses here.

References
----------
Fang et al. (2025), section 2.2 and equations (1)-(8), doi:10.20944/preprints202502.0192.v1. That agents take turns by
bidding, instead of all choosing at once, is ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor

from alloc.problems.instance import IDLE, Instance

SURPLUS = 1e6
"""Surplus of ability, in hours' work, that the place of the idle is credited with: leaving it costs nobody anything."""

MEAN_DISTANCE = 0.66
"""Distances are scaled to this mean, that of two points in the unit cube."""

PAIR_FEATURES = 21
TASK_FEATURES = 11
FEATURE_SET = "bidding-2"
"""Name of what `observe` returns; policies trained on another set do not load."""


@dataclass(frozen=True, eq=False)
class Board:
    """What stays fixed in a game: B instances with n agents and m tasks; index m is the place of the idle.

    Attributes
    ----------
    ability : Tensor, shape (B, n)
    target : Tensor, shape (B, m + 1)
        Ability that each task needs to be done at the reference makespan.
    distance : Tensor, shape (B, n, m + 1)
        From each agent's start, scaled to `MEAN_DISTANCE`.
    legal : Tensor of bool, shape (B, n, m + 1)
        Which tasks each agent can take.
    start : Tensor of int, shape (B, n)
        Where each agent is when the game begins.
    price : Tensor, shape (B,)
        Weight of energy in the reward.
    supply : Tensor, shape (B, m + 1)
        log of the ability that can reach each task over its target, halved, less 1: low where few can help.
    choice : Tensor, shape (B, n)
        Share of the tasks that each agent can take.
    """

    ability: Tensor
    target: Tensor
    distance: Tensor
    legal: Tensor
    start: Tensor
    price: Tensor
    supply: Tensor
    choice: Tensor

    @property
    def shape(self) -> tuple[int, int, int]:
        """B, n and m + 1."""
        return self.legal.shape[0], self.legal.shape[1], self.legal.shape[2]

    def __getitem__(self, rows: Tensor) -> Board:
        """Return the games with these numbers."""
        return Board(*(getattr(self, field.name)[rows] for field in fields(self)))

    def to(self, device: torch.device | str) -> Board:
        """Return the same board on another device."""
        return Board(*(getattr(self, field.name).to(device) for field in fields(self)))


@dataclass(frozen=True, eq=False)
class State:
    """Where everybody is.

    Attributes
    ----------
    task : Tensor of int, shape (B, n)
        Task of each agent, m for idle.
    group : Tensor, shape (B, m + 1)
        Ability at each task (W_j).
    done : Tensor of bool, shape (B,)
        Whether the game was ended by a "stop".
    """

    task: Tensor
    group: Tensor
    done: Tensor

    def __getitem__(self, rows: Tensor) -> State:
        """Return the states with these numbers."""
        return State(self.task[rows], self.group[rows], self.done[rows])


def make_board(
    instances: Sequence[Instance],
    reference_makespan: Sequence[float],
    price: Sequence[float],
    rng: np.random.Generator,
) -> Board:
    """Lay out games on `instances`, which must agree in numbers of agents and tasks.

    Parameters
    ----------
    instances : sequence of Instance
    reference_makespan : sequence of float
        Hours at which the demands are set, such as a lower bound on the makespan.
    price : sequence of float
        Weight of energy in each game.
    rng : numpy Generator
        Breaks ties between equally near tasks.
    """
    parts = [_layout(instance, hours, rng) for instance, hours in zip(instances, reference_makespan, strict=True)]
    ability, target, distance, legal, start = (np.stack(part) for part in zip(*parts, strict=True))

    def real(array: np.ndarray) -> Tensor:
        return torch.from_numpy(array.astype(np.float32))

    reachable = (legal * ability[..., None]).sum(axis=1)
    return Board(
        real(ability),
        real(target),
        real(distance),
        torch.from_numpy(legal),
        torch.from_numpy(start.astype(np.int64)),
        torch.tensor(price, dtype=torch.float32),
        real(np.log(np.maximum(reachable, 1e-3) / np.maximum(target, 1e-3)) / 2 - 1),
        real(legal.mean(axis=2)),
    )


def _layout(instance: Instance, hours: float, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    n, m = instance.n, instance.m
    reach = instance.reach
    useful = instance.workload > 0
    legal = np.column_stack([reach.mask[reach.origin] & useful, np.ones(n, dtype=bool)])
    distance = np.column_stack([reach.distance[reach.origin], np.zeros(n)])
    mean = distance[:, :m][legal[:, :m]].mean() if legal[:, :m].any() else 0.0
    distance *= MEAN_DISTANCE / mean if mean > 0 else 1.0
    away = np.where(legal[:, :m], distance[:, :m] + 1e-9 * rng.random((n, m)), np.inf)
    start = np.where(legal[:, :m].any(axis=1), away.argmin(axis=1), m)
    begun = instance.start_task != IDLE
    begun[begun] = legal[begun, instance.start_task[begun]]
    start[begun] = instance.start_task[begun]
    unit = instance.ability.mean()
    target = np.append(instance.workload / max(hours, 1e-300), 1.0)
    target[:m] = np.where(useful, target[:m], 0.0) / unit
    return instance.ability / unit, target, distance, legal, start


def begin(board: Board) -> State:
    """Return the state in which a game starts."""
    return State(board.start, group_ability(board, board.start), torch.zeros_like(board.price, dtype=torch.bool))


def group_ability(board: Board, task: Tensor) -> Tensor:
    """Return the ability at each task, shape (B, m + 1)."""
    return torch.zeros_like(board.target).scatter_add_(1, task, board.ability)


def deficit(board: Board, state: State) -> Tensor:
    """Return the ability that each task lacks, negative where it has too much, shape (B, m + 1)."""
    lack = board.target - state.group
    lack[:, -1] = -SURPLUS
    return lack


def step(board: Board, state: State, action: Tensor) -> State:
    """Grant one bid in each game.

    Parameters
    ----------
    action : Tensor of int, shape (B,)
        ``agent * (m + 1) + task``, or ``n * (m + 1)`` to stop; ignored in games that are done.
    """
    _, n, places = board.shape
    done = state.done | (action == n * places)
    rows = torch.nonzero(~done)[:, 0]
    agent, goal = action[rows] // places, action[rows] % places
    task, group = state.task.clone(), state.group.clone()
    moved = board.ability[rows, agent]
    group[rows, task[rows, agent]] -= moved
    group[rows, goal] += moved
    task[rows, agent] = goal
    return State(task, group, done)


def illegal_actions(board: Board, state: State) -> Tensor:
    """Return which actions may not be chosen, shape (B, n * (m + 1) + 1): staying, and what is out of reach."""
    batch, _, places = board.shape
    stays = torch.nn.functional.one_hot(state.task, places).bool()
    barred = (stays | ~board.legal).flatten(1) | state.done[:, None]
    return torch.cat([barred, barred.new_zeros(batch, 1)], 1)


def potential(board: Board, state: State) -> Tensor:
    """Return how good a state is, at most 0, shape (B,): its rise, less energy, is the reward of a step.

    Sums up the relative shortfall of ability in total, on average and at the worst task; the last is 1 - T_ref / T.
    """
    target, group = board.target[:, :-1], state.group[:, :-1]
    needed = target > 0
    lack = ((target - group).clamp(min=0) / target.clamp(min=1e-9)) * needed
    total = (lack * target).sum(1) / target.sum(1)
    return -4 * total - 2 * lack.sum(1) / needed.sum(1).clamp(min=1) - lack.amax(1)


def flown(board: Board, state: State) -> Tensor:
    """Return the mean distance per agent from its start to its task, flown directly (19), shape (B,)."""
    return board.distance.gather(2, state.task[..., None])[..., 0].mean(1)


def value_of(board: Board, state: State) -> Tensor:
    """Return potential less the price of the energy, shape (B,); the reward of a step is its rise."""
    return potential(board, state) - board.price * flown(board, state)


def pair_features(
    price: Tensor,
    ability: Tensor,
    choice: Tensor,
    own: tuple[Tensor, Tensor, Tensor, Tensor],
    other: tuple[Tensor, Tensor, Tensor, Tensor],
) -> Tensor:
    """Return what an agent knows of a move, shape (..., PAIR_FEATURES); the arguments broadcast to (...).

    Parameters
    ----------
    price : Tensor
        Weight of energy.
    ability, choice : Tensor
        Of the agent.
    own, other : tuple of Tensor
        Deficit, target, supply and distance of the task where the agent is, and of the one it bids for.
    """
    own_deficit, own_target, own_supply, own_distance = own
    deficit, target, supply, distance = other
    further = distance - own_distance
    gain = deficit.clamp(min=0) + own_deficit.clamp(min=0)
    gain = gain - (deficit - ability).clamp(min=0) - (own_deficit + ability).clamp(min=0)
    columns = [
        deficit / ability / 3,
        ((deficit - ability) / ability).clamp(-1, 1),
        own_deficit / ability / 3,
        ((own_deficit + ability) / ability).clamp(-1, 1),
        deficit / target,
        (deficit - ability) / target,
        own_deficit / own_target,
        (own_deficit + ability) / own_target,
        further,
        distance,
        price * further,
        price - 1,
        target.log() - 1.5,
        own_target.log() - 1.5,
        ability - 1,
        gain / ability,
        gain,
        (deficit < -SURPLUS / 2).float(),
        own_supply,
        supply,
        choice,
    ]
    return torch.stack(torch.broadcast_tensors(*columns), -1).clamp(-2, 2)


def observe_pairs(board: Board, state: State) -> Tensor:
    """Return `pair_features` of every agent and task, shape (B, n, m + 1, PAIR_FEATURES)."""
    lack, task = deficit(board, state), state.task
    target = board.target.clamp(min=1e-3)
    own = (
        lack.gather(1, task)[..., None],
        target.gather(1, task)[..., None],
        board.supply.gather(1, task)[..., None],
        board.distance.gather(2, task[..., None]),
    )
    other = (lack[:, None, :], target[:, None, :], board.supply[:, None, :], board.distance)
    return pair_features(board.price[:, None, None], board.ability[..., None], board.choice[..., None], own, other)


def observe_tasks(board: Board, state: State) -> Tensor:
    """Return what is known of each task and of all together, shape (B, m + 1, TASK_FEATURES)."""
    lack, target = deficit(board, state), board.target.clamp(min=1e-3)
    members = torch.zeros_like(target).scatter_add_(1, state.task, torch.ones_like(board.ability))
    needed = board.target[:, :-1] > 0
    ratio = (state.group / target)[:, :-1].masked_fill(~needed, 1.0).amin(1)
    short = lack[:, :-1].clamp(min=0).sum(1) / target[:, :-1].sum(1)
    idle = torch.zeros_like(target)
    idle[:, -1] = 1.0
    everywhere = target.shape
    columns = [
        lack / target,
        lack / 3,
        5 * lack / target,
        target.log() - 1.5,
        state.group / members.clamp(min=1) - 1,
        members.log1p() - 1.5,
        idle,
        ratio[:, None].expand(everywhere),
        5 * short[:, None].expand(everywhere),
        board.price[:, None].expand(everywhere) - 1,
        board.supply,
    ]
    return torch.stack(columns, -1).clamp(-2, 2)
