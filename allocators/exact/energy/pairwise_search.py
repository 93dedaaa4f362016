"""Search for plans of less energy by pairwise repartition and annealing."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.energy.energy_model import MAX_NEED, Mask
from alloc.allocators.exact.energy.pairwise import descend_pairs, perturb, total_distance
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.exact.model import ROUNDING, Model
from alloc.problems import Allocation, Instance
from alloc.problems.bounds import scale_to_one, typical_distance
from alloc.problems.instance import FloatArray, IntArray

MAX_WORK = 100_000_000
"""Limit on the table cells of a round of prices, or of a descent over all pairs of tasks, about 0.1 s."""

CYCLES = 0.1, 0.3, 0.6, 1.0
"""Shares of the annealing progress at which successive cooling cycles end; each starts from the best plan. Plans that
are good early also let bounds exclude more pairs."""


@dataclass(frozen=True)
class Perturbation:
    """Parameters of perturbations.

    Attributes
    ----------
    around : int
        Largest number of tasks perturbed at once.
    partners : int
        Number of nearest tasks with which a task is paired.
    strength, temperature : float
        Largest noise, and initial temperature of each cycle, as multiples of the mean distance of an agent.
    """

    around: int = 8
    partners: int = 64
    strength: float = 10.0
    temperature: float = 1.0


class PairwiseSearch:
    """An annealing search for less energy over plans that meet all needs.

    Parameters
    ----------
    task : ndarray of int, shape (n,)
        Initial task of each agent, ``len(need)`` for idle ones.
    weight : ndarray of int, shape (n,)
        Contribution of each agent to any task.
    distance : ndarray, shape (n, t)
        ``inf`` out of reach.
    need : ndarray of int, shape (t,)
    task_distance : ndarray, shape (t, t)
        Distances between tasks; only nearby ones are perturbed together.
    seed : int
    perturbation : Perturbation
    """

    def __init__(
        self,
        task: IntArray,
        weight: IntArray,
        distance: FloatArray,
        need: IntArray,
        task_distance: FloatArray,
        seed: int,
        perturbation: Perturbation = Perturbation(),
    ) -> None:
        tasks, idle = len(need), np.zeros((len(task), 1))
        self._perturbation, self._rng = perturbation, np.random.default_rng(seed)
        self._task = task.astype(np.int64)
        self._weight = weight.astype(np.int64)
        self._scale = scale_to_one(typical_distance(distance))
        self._distance = np.ascontiguousarray(np.hstack([distance * self._scale, idle]))
        self._need = np.append(need, 0).astype(np.int64)
        order = np.argsort(task_distance, axis=1, kind="stable").astype(np.int64)
        self._near = np.ascontiguousarray(order[:, : perturbation.around])
        self._pairs = _pairs(order[:, : perturbation.partners], tasks)
        self._all_distance, self._all_pairs = self._distance, self._pairs
        self._noise = np.zeros_like(self._distance)
        self._stale = np.ones(len(self._need), dtype=np.bool_)
        self.best, self._cycle = self._task.copy(), 0

    @property
    def cost(self) -> float:
        """Total distance of the best plan."""
        return float(total_distance(self.best, self._distance)) / self._scale

    def descend(self) -> bool:
        """Repartition all pairs of tasks once; return whether no pair can be improved any more."""
        descend_pairs(
            self._task, self._weight, self._distance, self._need, self._noise, self._pairs, self._stale, self._rng, 1
        )
        self.best = self._task.copy()
        return not self._stale.any()

    def adopt(self, task: IntArray) -> None:
        """Continue from a better plan, given the task of each agent, if it is also feasible with rounded weights."""
        agents, done = np.arange(len(task)), np.bincount(task, self._weight, len(self._need))
        if (done < self._need).any() or not np.isfinite(self._all_distance[agents, task]).all():
            return
        self._task, self.best = task.astype(np.int64), task.astype(np.int64)
        self._distance[agents, task] = self._all_distance[agents, task]

    def restrict(self, allowed: Mask) -> None:
        """Restrict agents to the allowed tasks, shape (n, t), and their tasks in the present and the best plan."""
        allowed, agents = np.hstack([allowed, np.ones((len(allowed), 1), dtype=bool)]), np.arange(len(allowed))
        allowed[agents, self._task] = allowed[agents, self.best] = True
        self._distance = np.where(allowed, self._all_distance, np.inf)
        can = np.isfinite(self._distance).astype(np.float64)
        self._pairs = self._all_pairs[(can.T @ can)[self._all_pairs[:, 0], self._all_pairs[:, 1]] > 0]

    def anneal(self, rounds: int, progress: float) -> None:
        """Perturb and descend `rounds` times at the given annealing progress, from 0 to 1."""
        unit = self.cost * self._scale / len(self._task) + 1e-300
        cycle = min(int(np.searchsorted(CYCLES, progress, side="right")), len(CYCLES) - 1)
        if cycle > self._cycle:
            self._cycle, self._task = cycle, self.best.copy()
        begin, end = (0.0, *CYCLES)[cycle : cycle + 2]
        perturb(
            self._task,
            self.best,
            self._weight,
            self._distance,
            self._need,
            self._pairs,
            self._near,
            self._noise,
            self._rng,
            rounds,
            self._perturbation.strength * unit,
            self._perturbation.temperature * unit * (end - progress) / (end - begin) + 1e-300,
        )


def _pairs(partners: WholeArray, tasks: int) -> WholeArray:
    """Return the pairs of partner tasks, and of each task with idleness, shape (p, 2)."""
    one = np.repeat(np.arange(tasks), partners.shape[1])
    both = np.sort(np.column_stack([one, partners.ravel()]), axis=1)
    both = np.unique(both[both[:, 0] < both[:, 1]], axis=0)
    idle = np.column_stack([np.arange(tasks), np.full(tasks, tasks)])
    return np.ascontiguousarray(np.vstack([both, idle]).astype(np.int64))


def begin_primal(
    instance: Instance, model: Model, demand: Demand, plan: Allocation, task_distance: FloatArray, seed: int
) -> PairwiseSearch | None:
    """Return the search started at `plan`; None if travel takes time, or its tables are too large."""
    if model.travel_time is not None:
        return None
    task = model.columns(plan)
    cost = np.where(model.classes.mask, model.classes.cost, np.inf)[:, model.tasks]
    if demand.integral and demand.need.max() <= MAX_NEED:
        weight, need = demand.ability.astype(np.int64), demand.need.astype(np.int64)
    else:
        work = model.workload / demand.time * (1 - ROUNDING)
        scale = MAX_NEED / work.max()
        weight, need = np.floor(model.classes.ability * scale).astype(np.int64), np.ceil(work * scale).astype(np.int64)
    served = np.bincount(task, minlength=len(need) + 1)[:-1] > 0
    need, cost = np.where(served, need, 0), np.where(served, cost, np.inf)
    partners = min(len(need), Perturbation().partners)
    if len(need) * partners / 2 * (instance.n + 2 * instance.n / len(need) * need.max()) > MAX_WORK:
        return None
    agent_class = model.classes.class_of_agent
    return PairwiseSearch(task, weight[agent_class], cost[agent_class], need, task_distance, seed)
