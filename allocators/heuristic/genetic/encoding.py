"""A population of allocations as a matrix, and the objectives of all its rows at once."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

Genes = NDArray[np.int32]
"""Rows of genes, shape (rows, n): the column of `Encoding.tasks` that each agent works on, or `Encoding.idle`."""

BoolArray = NDArray[np.bool_]

ROUNDING = 1e-9
"""Relative shortfall of a task up to which it counts as 0."""


@dataclass(frozen=True, eq=False)
class Objectives:
    """Objectives of the rows of a population; all of shape (rows,) except the last.

    Attributes
    ----------
    unserved : ndarray
        Number of tasks with workload and without an agent.
    shortfall : ndarray
        Sum over the tasks of max(0, 1 - W_j T / h_j), at the target makespan T.
    makespan : ndarray
        Makespan of the served tasks, in hours.
    energy : ndarray
        0 if it is not required.
    group_ability : ndarray, shape (rows, c)
        W of each task.
    """

    unserved: FloatArray
    shortfall: FloatArray
    makespan: FloatArray
    energy: FloatArray
    group_ability: FloatArray


class Encoding:
    """Encoding of allocations of an instance as rows of genes; read-only.

    Only tasks with workload have a column. One more column stands for idle agents; it is at every agent's start and has
    no demand, so that all its ability is surplus.

    Attributes
    ----------
    tasks : ndarray of int, shape (c,)
        Tasks with workload.
    idle : int
        The column c of idle agents.
    ability : ndarray, shape (n + 1,)
        Work per hour of the agents, and 0 for `no_agent`.
    no_agent : int
        The index n of a dummy agent, with which a swap becomes a move.
    workload : ndarray, shape (c,)
        Workloads of `tasks`, all positive.
    """

    def __init__(self, instance: Instance) -> None:
        self.instance, self.reach = instance, instance.reach
        self.n, self.no_agent = instance.n, instance.n
        self.tasks = np.flatnonzero(instance.workload > 0)
        self.idle = len(self.tasks)
        self.workload = instance.workload[self.tasks]
        self.ability = np.append(instance.ability, 0.0)
        self._origin = np.append(self.reach.origin, 0)
        self._task = np.append(self.tasks, 0)
        self.is_complete = self.reach.is_complete

    @cached_property
    def mean_cost(self) -> float:
        """Mean cost of flights from the agents' starts to tasks; 1 if all are 0."""
        return float(self.reach.cost.mean()) or 1.0

    def group_abilities(self, genes: Genes) -> FloatArray:
        """Return W of each column, including that of idle agents, shape (rows, c + 1)."""
        rows, width = len(genes), self.idle + 1
        cell = genes + (np.arange(rows) * width)[:, None]
        weights = np.broadcast_to(self.ability[:-1], genes.shape)
        group: FloatArray = np.bincount(cell.ravel(), weights=weights.ravel(), minlength=rows * width).astype(float)
        return group.reshape(rows, width)

    def demand(self, makespan: float) -> FloatArray:
        """Return the ability that each task needs to be done within a makespan in hours, shape (c,)."""
        with np.errstate(over="ignore"):
            return np.clip(self.workload / makespan, np.finfo(float).tiny, np.finfo(float).max)

    def objectives(self, genes: Genes, target_makespan: float, with_energy: bool = True) -> Objectives:
        """Return the objectives of each row; the shortfall refers to `target_makespan`, in hours."""
        group = self.group_abilities(genes)[:, :-1]
        served = group > 0
        with np.errstate(divide="ignore", over="ignore"):
            time = np.where(served, self.workload / group, 0.0)
            shortfall = np.maximum(0.0, 1 - group / self.demand(target_makespan))
            cost = self.cost(np.arange(self.n), genes).sum(axis=1) if with_energy else np.zeros(len(genes))
            energy = cost * self.reach.energy_per_distance
        shortfall[shortfall < ROUNDING] = 0.0
        return Objectives(
            unserved=(~served).sum(axis=1).astype(float),
            shortfall=shortfall.sum(axis=1).round(12),
            makespan=time.max(axis=1),
            energy=energy,
            group_ability=group,
        )

    def allows(self, agent: IntArray, column: NDArray[np.integer]) -> BoolArray:
        """Return whether each agent can take the column at its index; `no_agent` can take any, and all can be idle."""
        if self.is_complete:
            return np.ones(np.broadcast_shapes(agent.shape, column.shape), dtype=bool)
        reachable = self.reach.mask[self._origin[agent], self._task[column]]
        allowed: BoolArray = reachable | (agent == self.no_agent) | (column == self.idle)
        return allowed

    def cost(self, agent: IntArray, column: NDArray[np.integer]) -> FloatArray:
        """Return the cost of each agent's flight to the column at its index; 0 for `no_agent` and idle agents."""
        cost = self.reach.cost[self._origin[agent], self._task[column]]
        return np.where((agent == self.no_agent) | (column == self.idle), 0.0, cost)

    def encode(self, allocation: Allocation) -> Genes:
        """Return the genes of an allocation, shape (n,); agents on unreachable or empty tasks become idle."""
        column = np.full(self.instance.m + 1, self.idle, dtype=np.int32)
        column[self.tasks] = np.arange(self.idle)
        genes = column[allocation.task_of_agent]  # IDLE is -1, the last entry
        genes[~self.allows(np.arange(self.n), genes)] = self.idle
        return genes

    def decode(self, genes: Genes) -> Allocation:
        """Return the allocation of one row of genes."""
        return Allocation(np.append(self.tasks, IDLE)[genes])
