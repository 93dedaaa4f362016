"""Plans of less energy by pairwise repartition and annealing."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.exact.energy.pairwise import descend_pairs, perturb, total_distance
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.bounds import scale_to_one, typical_distance
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True)
class Perturbation:
    """How plans are perturbed.

    Attributes
    ----------
    around : int
        Tasks perturbed at once, at most.
    partners : int
        Nearest tasks that a task is paired with.
    strength, temperature : float
        Largest noise, and temperature to begin with, as multiples of the mean distance of an agent.
    """

    around: int = 8
    partners: int = 64
    strength: float = 10.0
    temperature: float = 0.3


class PairwiseSearch:
    """An annealed search over plans in which every task has what it needs, for less energy.

    Parameters
    ----------
    task : ndarray of int, shape (n,)
        Task of each agent to begin with, ``len(need)`` for idle ones.
    weight : ndarray of int, shape (n,)
        What each agent adds to its task, whatever the task.
    distance : ndarray, shape (n, t)
        ``inf`` where an agent cannot go.
    need : ndarray of int, shape (t,)
    task_distance : ndarray, shape (t, t)
        How far tasks are from each other; only near ones are perturbed together.
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
        self._noise = np.zeros_like(self._distance)
        self._stale = np.ones(len(self._need), dtype=np.bool_)
        self.best = self._task.copy()

    @property
    def cost(self) -> float:
        """Sum of distances of the best plan."""
        return float(total_distance(self.best, self._distance)) / self._scale

    def descend(self) -> bool:
        """Repartition all pairs of tasks once; return whether none can be improved any more."""
        descend_pairs(
            self._task, self._weight, self._distance, self._need, self._noise, self._pairs, self._stale, self._rng, 1
        )
        self.best = self._task.copy()
        return not self._stale.any()

    def anneal(self, rounds: int, progress: float) -> None:
        """Perturb and descend `rounds` times, `progress` being how far annealing is, from 0 to 1."""
        unit = self.cost * self._scale / len(self._task) + 1e-300
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
            self._perturbation.temperature * unit * (1 - progress) + 1e-300,
        )


def _pairs(partners: WholeArray, tasks: int) -> WholeArray:
    """Pairs of tasks, shape (p, 2), and of each task with idleness."""
    one = np.repeat(np.arange(tasks), partners.shape[1])
    both = np.sort(np.column_stack([one, partners.ravel()]), axis=1)
    both = np.unique(both[both[:, 0] < both[:, 1]], axis=0)
    idle = np.column_stack([np.arange(tasks), np.full(tasks, tasks)])
    return np.ascontiguousarray(np.vstack([both, idle]).astype(np.int64))
