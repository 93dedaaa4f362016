"""The least-energy problem in small whole numbers: what the Lagrangian relaxation bounds."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.model import ROUNDING
from alloc.problems.instance import FloatArray

Mask = NDArray[np.bool_]

GRID = 2048
"""Steps into which a need is divided where it is no small whole number."""

MAX_NEED = 5000
"""Whole needs up to this are left as they are."""


@dataclass(frozen=True, eq=False)
class EnergyModel:
    """(work), (agents) and (energy) of `exact.model` in whole weights and needs, the pairs in the order of tasks.

    A plan gives each task j agents with weights that sum to ``need[j]`` at least and ``max_weight[j]`` at most, and has
    from `min_agents` to `count` agents of each class at work.

    Attributes
    ----------
    class_of_pair, task_of_pair : ndarray of int, shape (p,)
        Class and task of each pair.
    weight : ndarray of int, shape (p,)
        What one agent adds to the task.
    copies : ndarray of int, shape (p,)
        Agents that the task could use.
    cost : ndarray, shape (p,)
        Distance of one agent.
    need, max_weight : ndarray of int, shape (t,)
        `max_weight` is -1 where there is no limit.
    count, min_agents : ndarray of int, shape (k,)
    ability : ndarray of int, shape (k,), or None
        What one agent adds to any task, for the clusters; None where that depends on the task.
    """

    class_of_pair: WholeArray
    task_of_pair: WholeArray
    weight: WholeArray
    copies: WholeArray
    cost: FloatArray
    need: WholeArray
    max_weight: WholeArray
    count: WholeArray
    min_agents: WholeArray
    ability: WholeArray | None

    def only(self, keep: Mask) -> "EnergyModel":
        """Return the model with some of its pairs."""
        return replace(
            self,
            class_of_pair=self.class_of_pair[keep],
            task_of_pair=self.task_of_pair[keep],
            weight=self.weight[keep],
            copies=self.copies[keep],
            cost=self.cost[keep],
        )

    @property
    def first(self) -> WholeArray:
        """Where the pairs of each task begin, shape (t + 1,)."""
        return np.searchsorted(self.task_of_pair, np.arange(len(self.need) + 1)).astype(np.int64)


def round_demand(demand: Demand, cost: FloatArray) -> tuple[EnergyModel, WholeArray]:
    """Round `demand` to small whole numbers such that every plan that meets it meets these.

    Parameters
    ----------
    demand : Demand
    cost : ndarray, shape (p,)
        Distance of one agent of each pair.

    Returns
    -------
    EnergyModel
    ndarray of int
        Which pairs of `demand` its pairs are; pairs too large for their task are left out.
    """
    order = np.lexsort((demand.class_of_pair, demand.task_of_pair))
    agent_class, task, need = demand.class_of_pair[order], demand.task_of_pair[order], demand.need
    limited = demand.spare < demand.ability.max()
    usable = np.ones(len(order), dtype=bool)
    if demand.integral and need.max() <= MAX_NEED:
        ability = demand.ability.astype(np.int64)
        weight = ability[agent_class] if limited else demand.weight[order].astype(np.int64)
        max_weight = demand.max_weight if limited else np.full(len(need), -1)
        usable = weight <= max_weight[task] if limited else usable
    else:
        weight = np.ceil(demand.weight[order] / need[task] * (GRID * (1 - ROUNDING))).astype(np.int64)
        ability, limited, need, max_weight = None, False, np.full(len(need), GRID), np.full(len(need), -1)
    model = EnergyModel(
        class_of_pair=agent_class.astype(np.int64),
        task_of_pair=task.astype(np.int64),
        weight=weight,
        copies=demand.max_count[order].astype(np.int64),
        cost=cost[order],
        need=need.astype(np.int64),
        max_weight=max_weight.astype(np.int64),
        count=demand.count.astype(np.int64),
        min_agents=demand.min_agents.astype(np.int64) if limited else np.zeros(len(demand.count), dtype=np.int64),
        ability=ability,
    )
    return model.only(usable), order[usable]
