"""Games on regions of an instance: small groups of tasks with the agents that work there."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.problems.distances.metric import distances
from alloc.problems.game.board import Board
from alloc.problems.game.layout import MEAN_DISTANCE, SHORTEST_HOURS, UnscaledGames
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Regions:
    """Games on G regions of one instance, with up to k agents and j tasks each.

    Attributes
    ----------
    board : Board
        One game per region; regions with fewer agents are padded with agents that have no ability and cannot move.
    agents : ndarray of int, shape (G, k)
        Agents of each region, -1 for padding.
    tasks : ndarray of int, shape (G, j)
    nearest : Tensor of int, shape (G, k)
        The nearest candidate of each agent.
    """

    board: Board
    agents: Ints
    tasks: Ints
    nearest: torch.Tensor

    def merge(self, plan: Ints, slots: Ints, accepted: NDArray[np.bool_]) -> Ints:
        """Return `plan` with the outcomes of the accepted games applied, shape (n,).

        Parameters
        ----------
        plan : ndarray of int, shape (n,)
        slots : ndarray of int, shape (G, k)
        accepted : ndarray of bool, shape (G,)
        """
        region, member = np.nonzero((self.agents >= 0) & accepted[:, None])
        slot, idle = slots[region, member], self.tasks.shape[1]
        result = plan.copy()
        result[self.agents[region, member]] = np.where(
            slot == idle, IDLE, self.tasks[region, np.minimum(slot, idle - 1)]
        )
        return result


def lay_out_regions(
    instance: Instance, hours: float, plan: Ints, tasks: Ints, agents: Sequence[Ints], energy_weight: float = 1.0
) -> Regions:
    """Return games in which the agents of each region are reallocated to its tasks.

    Parameters
    ----------
    hours : float
        Makespan for which needs are computed.
    plan : ndarray of int, shape (n,)
        Initial task of each agent, `IDLE` for none.
    tasks : ndarray of int, shape (G, j)
        Tasks of each region.
    agents : sequence of G ndarrays of int
        Agents of each region, each at one of its tasks or idle.
    energy_weight : float
        Weight of energy in the reward.
    """
    members = _members(agents)
    games = _unscaled(instance, hours, tasks, members)
    here = plan[np.maximum(members, 0)][..., None] == tasks[:, None]
    start = games.slots_at(here, otherwise=tasks.shape[1])
    board = games.board(_scale(games), start, np.full(len(tasks), energy_weight))
    return Regions(board, members, tasks, torch.from_numpy(games.nearest))


def _members(agents: Sequence[Ints]) -> Ints:
    """Return the agents of each region in one array, shape (G, k), padded with -1."""
    members = np.full((len(agents), max(1, max(len(some) for some in agents))), -1, dtype=np.int64)
    for region, some in enumerate(agents):
        members[region, : len(some)] = some
    return members


def _unscaled(instance: Instance, hours: float, tasks: Ints, members: Ints) -> UnscaledGames:
    (count, j), width = tasks.shape, members.shape[1]
    real, someone = members >= 0, np.maximum(members, 0)
    shape = (count, width, j + 1)
    agent, task = np.broadcast_arrays(someone[..., None], tasks[:, None])
    distance, reachable = np.zeros(shape), np.zeros(shape, dtype=np.bool_)
    distance[..., :j] = instance.reach.distance_of(agent, task)
    reachable[..., :j] = instance.reach.allows(agent, task) & real[..., None]
    position = instance.reach.goal[tasks]
    cost = distance
    if not instance.reach.cost_is_distance:
        cost = np.zeros(shape)
        cost[..., :j] = instance.reach.cost_of(agent, task)
    return UnscaledGames(
        ability=np.where(real, instance.ability[someone], 0.0),
        speed=instance.speed[someone],
        endurance=np.full(members.shape, np.inf),
        workload=instance.workload[tasks],
        priority=instance.priority[tasks],
        candidates=np.broadcast_to(np.arange(j + 1), shape).copy(),
        reachable=reachable,
        distance=distance,
        cost=cost,
        task_distance=distances(position[:, :, None], position[:, None]),
        hours=np.full(count, max(hours, SHORTEST_HOURS)),
        log_tau=np.full(count, math.log(instance.tau)),
    )


def _scale(games: UnscaledGames) -> NDArray[np.float64]:
    """Return the factor that scales the mean distance of legal pairs to `MEAN_DISTANCE`; shape (G,)."""
    legal = games.legal[..., :-1]
    mean = (games.cost[..., :-1] * legal).sum((1, 2)) / np.maximum(legal.sum((1, 2)), 1)
    return np.where(mean > 0, MEAN_DISTANCE / np.where(mean > 0, mean, 1.0), 1.0)
