"""A population of allocations as one matrix: figures of all its rows at once, and the rows to begin with."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

Genes = NDArray[np.int32]
"""Rows of genes, shape (rows, n): the column of `Landscape.tasks` that each agent works on, or the bench."""

BoolArray = NDArray[np.bool_]

CHECK_EVERY = 64
"""Agents between two looks at the clock."""

ROUNDING = 1e-9
"""Relative shortfall of a task that counts as none."""


@dataclass(frozen=True, eq=False)
class Figures:
    """What the rows of a population achieve; each of shape (rows,) but the last.

    Attributes
    ----------
    unserved : ndarray
        Tasks with workload and without an agent.
    shortfall : ndarray
        Sum over the tasks of max(0, 1 - W_j T / h_j), at the makespan T that is aimed at.
    makespan : ndarray
        Over the served tasks, in hours.
    energy : ndarray
        Energy of the direct flights, 0 where it is not asked for.
    group : ndarray, shape (rows, c)
        W of each task.
    """

    unserved: FloatArray
    shortfall: FloatArray
    makespan: FloatArray
    energy: FloatArray
    group: FloatArray


class Landscape:
    """An instance as the genetic algorithm sees it; read-only.

    Only tasks with workload have a column. Idle agents sit on one more task, the *bench*: it lies at everyone's start,
    needs no ability, and so gives to every other task whatever it has.

    Attributes
    ----------
    tasks : ndarray of int, shape (c,)
        Tasks with workload.
    bench : int
        The column c.
    ability : ndarray, shape (n + 1,)
        Work per hour of the agents, and of nobody, who has number n and makes a move out of an exchange.
    workload : ndarray, shape (c,)
        Workloads of `tasks`, all positive.
    """

    def __init__(self, instance: Instance) -> None:
        self.instance, self.reach = instance, instance.reach
        self.n, self.nobody = instance.n, instance.n
        self.tasks = np.flatnonzero(instance.workload > 0)
        self.bench = len(self.tasks)
        self.workload = instance.workload[self.tasks]
        self.ability = np.append(instance.ability, 0.0)
        self._origin = np.append(self.reach.origin, 0)
        self._task = np.append(self.tasks, 0)
        self.is_complete = self.reach.is_complete

    @cached_property
    def mean_distance(self) -> float:
        """Mean distance of tasks from the agents' starts; 1 where all are 0."""
        return float(self.reach.distance.mean()) or 1.0

    def group_abilities(self, genes: Genes) -> FloatArray:
        """Return W of each task and of the bench, shape (rows, c + 1)."""
        rows, width = len(genes), self.bench + 1
        cell = genes + (np.arange(rows) * width)[:, None]
        weights = np.broadcast_to(self.ability[:-1], genes.shape)
        group: FloatArray = np.bincount(cell.ravel(), weights=weights.ravel(), minlength=rows * width).astype(float)
        return group.reshape(rows, width)

    def demand(self, aim: float) -> FloatArray:
        """Return the ability that each task needs to be done within `aim` hours, shape (c,)."""
        with np.errstate(over="ignore"):
            return np.clip(self.workload / aim, np.finfo(float).tiny, np.finfo(float).max)

    def figures(self, genes: Genes, aim: float, with_energy: bool = True) -> Figures:
        """Return what each row achieves; `aim` is the makespan, in hours, that the shortfall is measured against."""
        group = self.group_abilities(genes)[:, :-1]
        served = group > 0
        with np.errstate(divide="ignore", over="ignore"):
            time = np.where(served, self.workload / group, 0.0)
            lack = np.maximum(0.0, 1 - group / self.demand(aim))
            flown = self.distance(np.arange(self.n), genes).sum(axis=1) if with_energy else np.zeros(len(genes))
            energy = flown * self.instance.energy_per_distance
        lack[lack < ROUNDING] = 0.0
        return Figures(
            unserved=(~served).sum(axis=1).astype(float),
            shortfall=lack.sum(axis=1).round(12),
            makespan=time.max(axis=1),
            energy=energy,
            group=group,
        )

    def allows(self, agent: IntArray, column: NDArray[np.integer]) -> BoolArray:
        """Whether each agent can take the column beside it; nobody can take any, and anyone the bench."""
        if self.is_complete:
            return np.ones(np.broadcast_shapes(agent.shape, column.shape), dtype=bool)
        free = self.reach.mask[self._origin[agent], self._task[column]]
        either: BoolArray = free | (agent == self.nobody) | (column == self.bench)
        return either

    def distance(self, agent: IntArray, column: NDArray[np.integer]) -> FloatArray:
        """Distance from each agent's start to the column beside it; 0 for nobody and for the bench."""
        away = self.reach.distance[self._origin[agent], self._task[column]]
        return np.where((agent == self.nobody) | (column == self.bench), 0.0, away)

    def encode(self, allocation: Allocation) -> Genes:
        """Return the genes of an allocation, shape (n,); agents where they cannot or need not go sit on the bench."""
        column = np.full(self.instance.m + 1, self.bench, dtype=np.int32)
        column[self.tasks] = np.arange(self.bench)
        genes = column[allocation.task_of_agent]  # IDLE, -1, finds the last entry: the bench
        genes[~self.allows(np.arange(self.n), genes)] = self.bench
        return genes

    def decode(self, genes: Genes) -> Allocation:
        """Return the allocation of one row of genes."""
        return Allocation(np.append(self.tasks, IDLE)[genes])


def list_schedules(
    landscape: Landscape, noise: FloatArray, nearness: FloatArray, rng: np.random.Generator, stop: Callable[[], bool]
) -> Genes:
    """Build one allocation per row by list scheduling: agent after agent, to the task with the lowest W / h.

    Parameters
    ----------
    landscape : Landscape
    noise : ndarray, shape (rows,)
        Standard deviation of what is added to the logarithm of an ability before agents are sorted, largest first.
    nearness : ndarray, shape (rows,)
        What the mean distance adds to W / h, in units of the final mean of W / h: 0 ignores distances.
    rng : Generator
    stop : callable
        Asked now and then whether time is up; the agents that are left then sit on the bench.

    Returns
    -------
    ndarray of int, shape (rows, n)
    """
    rows, reach = len(noise), landscape.reach
    genes = np.full((rows, landscape.n), landscape.bench, dtype=np.int32)
    ability, row = landscape.ability, np.arange(rows)
    order = np.argsort(-(np.log(ability[:-1]) + noise[:, None] * rng.standard_normal(genes.shape)), axis=1)
    mean = ability.sum() / landscape.workload.sum()
    fill = np.zeros((rows, landscape.bench))
    near, all_tasks = bool(nearness.any()), len(landscape.tasks) == landscape.instance.m
    for step, agents in enumerate(order.T):
        if step % CHECK_EVERY == 0 and stop():
            break
        origin = reach.origin[agents]
        cost = fill
        if near:
            away = reach.distance[origin] if all_tasks else reach.distance[origin][:, landscape.tasks]
            cost = cost + (nearness * mean / landscape.mean_distance)[:, None] * away
        if not landscape.is_complete:
            free = reach.mask[origin] if all_tasks else reach.mask[origin][:, landscape.tasks]
            cost = np.where(free, cost, np.inf)
        best = cost.argmin(axis=1)
        able = cost[row, best] < np.inf
        fill[row[able], best[able]] += ability[agents[able]] / landscape.workload[best[able]]
        genes[row[able], agents[able]] = best[able]
    return genes
