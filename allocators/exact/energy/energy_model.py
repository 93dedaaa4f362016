"""The least-energy problem in small integers, or in shares of needs, as bounded by the Lagrangian relaxation."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.model import ROUNDING
from alloc.problems.instance import FloatArray

Mask = NDArray[np.bool_]

MAX_NEED = 5000
"""Integer needs up to this are not rounded."""

SMALLEST_WEIGHT = 1e-12
"""Share of a need to which smaller weights are raised."""


@dataclass(frozen=True, eq=False)
class EnergyModel:
    """(work), (agents) and (energy) of `exact.model`, with pairs sorted by task.

    Weights and needs are all integers or all floats; in the latter case needs are about 1 and have no `max_weight`.

    A plan gives each task j agents with weights that sum to ``need[j]`` at least and ``max_weight[j]`` at most, and has
    from `min_agents` to `count` agents of each class at work.

    Attributes
    ----------
    class_of_pair, task_of_pair : ndarray of int, shape (p,)
        Class and task of each pair.
    weight : ndarray of int or float, shape (p,)
        Contribution of one agent to the task.
    copies : ndarray of int, shape (p,)
        Number of agents that the task could use.
    cost : ndarray, shape (p,)
        Distance of one agent.
    need : ndarray of int or float, shape (t,)
    max_weight : ndarray of int, shape (t,)
        -1 for no limit.
    count, min_agents : ndarray of int, shape (k,)
    ability : ndarray of int, shape (k,), or None
        Contribution of one agent to any task, for the clusters; None if that depends on the task.
    """

    class_of_pair: WholeArray
    task_of_pair: WholeArray
    weight: WholeArray | FloatArray
    copies: WholeArray
    cost: FloatArray
    need: WholeArray | FloatArray
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

    def by_class(self, group: csr_array) -> csr_array:
        """Return the agents of each class, shape (g, k), in groups given by pairs, shape (g, p)."""
        pairs = len(self.class_of_pair)
        entry = (np.ones(pairs), (np.arange(pairs), self.class_of_pair))
        return csr_array(group @ csr_array(entry, shape=(pairs, len(self.count))))

    @property
    def is_whole(self) -> bool:
        """Whether weights and needs are integers."""
        return self.need.dtype.kind == "i"

    @property
    def first(self) -> WholeArray:
        """Index of the first pair of each task, shape (t + 1,)."""
        return np.searchsorted(self.task_of_pair, np.arange(len(self.need) + 1)).astype(np.int64)


def round_demand(demand: Demand, cost: FloatArray) -> tuple[EnergyModel, WholeArray]:
    """Return a relaxation of `demand` in small integers or in shares of needs: every plan that meets it meets these.

    Parameters
    ----------
    demand : Demand
    cost : ndarray, shape (p,)
        Distance of one agent of each pair.

    Returns
    -------
    EnergyModel
    ndarray of int
        Indices of its pairs in `demand`; pairs too large for their task are left out.
    """
    order = np.lexsort((demand.class_of_pair, demand.task_of_pair))
    agent_class, task, need = demand.class_of_pair[order], demand.task_of_pair[order], demand.need
    limited = demand.spare < demand.ability.max()
    usable = np.ones(len(order), dtype=bool)
    weight: WholeArray | FloatArray
    if demand.integral and need.max() <= MAX_NEED:
        ability = demand.ability.astype(np.int64)
        weight = ability[agent_class] if limited else demand.weight[order].astype(np.int64)
        max_weight = demand.max_weight if limited else np.full(len(need), -1)
        usable = weight <= max_weight[task] if limited else usable
        need = need.astype(np.int64)
    else:
        weight = np.maximum(demand.weight[order] / need[task], SMALLEST_WEIGHT)
        ability, limited, max_weight = None, False, np.full(len(need), -1)
        need = np.full(len(need), 1 - 100 * ROUNDING)  # sums of many floats are not exact
    model = EnergyModel(
        class_of_pair=agent_class.astype(np.int64),
        task_of_pair=task.astype(np.int64),
        weight=weight,
        copies=demand.max_count[order].astype(np.int64),
        cost=cost[order],
        need=need,
        max_weight=max_weight.astype(np.int64),
        count=demand.count.astype(np.int64),
        min_agents=demand.min_agents.astype(np.int64) if limited else np.zeros(len(demand.count), dtype=np.int64),
        ability=ability,
    )
    return model.only(usable), order[usable]
