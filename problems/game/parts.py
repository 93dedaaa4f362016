"""Parts of an instance as games of their own: a few tasks, and the agents that work there."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from alloc.problems.distances.metric import distances
from alloc.problems.game.board import LARGEST, LEAST, MEAN_DISTANCE, Board, scaled, single, working_share
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Parts:
    """Games on parts of one instance.

    Attributes
    ----------
    board : Board
        As many games as parts; where a part has fewer agents than others, the rest are agents without ability that
        cannot go anywhere.
    agents : ndarray of int, shape (G, k)
        Agents of each part, -1 for none.
    tasks : ndarray of int, shape (G, j)
    home : Tensor of int, shape (G, k)
        The nearest candidate of each agent.
    """

    board: Board
    agents: Ints
    tasks: Ints
    home: torch.Tensor

    def merge(self, plan: Ints, slots: NDArray[np.int64], accepted: NDArray[np.bool_]) -> Ints:
        """Return a plan, tasks by agent and `IDLE`, with what was decided in the accepted games."""
        result = plan.copy()
        idle = len(self.tasks[0])
        for part in np.flatnonzero(accepted).tolist():
            real = self.agents[part] >= 0
            slot = slots[part][real]
            place = np.where(slot == idle, IDLE, self.tasks[part][np.minimum(slot, idle - 1)])
            result[self.agents[part][real]] = place
        return result


def lay_out_parts(
    instance: Instance, hours: float, plan: Ints, tasks: Ints, agents: Sequence[Ints], price: float = 1.0
) -> Parts:
    """Lay out games in which the agents of a part share its tasks out anew.

    Parameters
    ----------
    hours : float
        Makespan at which the needs are set.
    plan : ndarray of int, shape (n,)
        Task of each agent, `IDLE` for none: where the games begin.
    tasks : ndarray of int, shape (G, j)
        Tasks of each part.
    agents : sequence of G ndarrays of int
        Agents of each part; each is at one of its tasks or idle.
    """
    count, j = tasks.shape
    width = max(1, max(len(some) for some in agents))
    who = np.full((count, width), -1, dtype=np.int64)
    for part, some in enumerate(agents):
        who[part, : len(some)] = some
    real = who >= 0
    someone = np.where(real, who, 0)
    agent = np.repeat(someone.ravel(), j)
    task = np.repeat(tasks[:, None], width, axis=1).ravel()
    shape = (count, width, j)
    distance = instance.reach.distance_of(agent, task).reshape(shape)
    legal = instance.reach.allows(agent, task).reshape(shape) & real[..., None]
    legal &= (instance.workload[tasks] > 0)[:, None, :]
    share = working_share(instance.speed[agent], distance.ravel(), hours).reshape(shape)
    legal &= share > 0
    ability = np.where(real, instance.ability[someone], 0.0)
    unit = ability.sum(1) / np.maximum(real.sum(1), 1)
    unit = np.where(unit > 0, unit, 1.0)
    ability = ability / unit[:, None]
    reached = legal.sum((1, 2))
    mean = (distance * legal).sum((1, 2)) / np.maximum(reached, 1)
    scale = np.where(mean > 0, MEAN_DISTANCE / np.where(mean > 0, mean, 1.0), 1.0)
    contribution = ability[..., None] * share
    with np.errstate(over="ignore"):
        need = np.minimum(instance.workload[tasks] / max(hours, 1e-300) / unit[:, None], LARGEST)
    supply = np.log(np.maximum((contribution * legal).sum(1), LEAST) / np.maximum(need, LEAST)) / 2 - 1
    weight = _weights(instance.priority[tasks], instance.workload[tasks] > 0)
    away = np.where(legal, distance, np.inf)
    home = np.where(legal.any(2), away.argmin(2), j)
    slot = (plan[someone][..., None] == tasks[:, None]) & legal
    start = np.where(slot.any(2), slot.argmax(2), j)
    last = ((0, 0), (0, 0), (0, 1))
    position = instance.task_position[tasks]
    apart = scaled(distances(position[:, :, None], position[:, None]), scale[:, None, None])
    legal = np.concatenate([legal, np.ones((count, width, 1), dtype=bool)], axis=2)
    board = Board(
        **{
            name: torch.from_numpy(np.ascontiguousarray(value if value.dtype.kind in "ib" else single(value)))
            for name, value in {
                "ability": ability,
                "need": np.pad(need, ((0, 0), (0, 1))),
                "weight": np.pad(weight, ((0, 0), (0, 1))),
                "goal": np.broadcast_to(np.arange(j + 1), (count, width, j + 1)).copy(),
                "legal": legal,
                "distance": np.pad(scaled(distance, scale[:, None, None]), last),
                "contribution": np.concatenate([contribution, ability[..., None]], axis=2),
                "start": start,
                "price": np.full(count, price),
                "supply": np.pad(supply, ((0, 0), (0, 1))),
                "choice": legal.mean(2),
                "apart": np.pad(apart, ((0, 0), (0, 1), (0, 1))),
                "endurance": np.full((count, width), np.inf),
                "log_tau": np.maximum(np.log(instance.tau) * unit, -LARGEST),
            }.items()
        },
        scale=torch.from_numpy(scale),
    )
    return Parts(board, who, tasks, torch.from_numpy(home))


def _weights(priority: NDArray[np.float64], useful: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Priority over its mean among the tasks with workload, by part; 1 where none of these has any; shape (G, j)."""
    priority = np.where(useful, priority, 0.0)
    highest = priority.max(1, keepdims=True)
    priority = np.where(highest > 0, priority / np.where(highest > 0, highest, 1.0), useful)
    mean = priority.sum(1, keepdims=True) / np.maximum(useful.sum(1, keepdims=True), 1)
    return priority / np.where(mean > 0, mean, 1.0)
