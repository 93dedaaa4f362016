"""Data of the constraints at a fixed makespan T: weights of agents, needs of tasks, and sizes of classes."""

from dataclasses import dataclass, replace

import numpy as np

from alloc.problems.instance import FloatArray, IntArray

MET = 1 - 1e-9
"""Share of a need from which it counts as met, so that no T is excluded by rounding errors."""


@dataclass(frozen=True, eq=False)
class Demand:
    """Data of the constraints (work) and (agents) of `exact.model` at T, without pairs of no use.

    Attributes
    ----------
    time : float
        T in hours.
    class_of_pair, task_of_pair : ndarray of int, shape (p,)
        Class, and row in `need`, of each pair: k and j of its variable x_kj.
    weight : ndarray, shape (p,)
        Contribution of one agent of the class to the task, capped at the need.
    max_count : ndarray of int, shape (p,)
        Upper bound of the variable: number of agents of the class that the task could use.
    need : ndarray, shape (t,)
        Required sum of weights of each task.
    count : ndarray of int, shape (k,)
        Number of agents in each class.
    min_served : int
        Number of tasks that must be served: all, t, unless too few agents can reach them.
    integral : bool
        Whether weights and needs are integers.
    spare : float
        Total ability minus the sum of all needs, in their unit; ``inf`` if unknown.
    ability : ndarray, shape (k,)
        Ability of each class, in the same unit.
    """

    time: float
    class_of_pair: IntArray
    task_of_pair: IntArray
    weight: FloatArray
    max_count: IntArray
    need: FloatArray
    count: IntArray
    min_served: int
    integral: bool
    spare: float
    ability: FloatArray

    @property
    def max_weight(self) -> FloatArray:
        """Largest sum of weights of each task that leaves enough ability for the others, shape (t,)."""
        return self.need + self.spare

    @property
    def min_agents(self) -> IntArray:
        """Number of agents of each class that must work, as the other classes cannot meet all needs, shape (k,)."""
        if np.isinf(self.spare):
            return np.zeros_like(self.count)
        useful = np.bincount(self.class_of_pair, minlength=len(self.count)) > 0
        return np.where(useful, np.maximum(0, self.count - np.floor(self.spare / self.ability)), 0).astype(np.intp)

    @property
    def partial(self) -> bool:
        """Whether some tasks may stay unserved."""
        return self.min_served < len(self.need)

    @property
    def trivially_infeasible(self) -> bool:
        """Whether total ability is too small, or too many tasks cannot be met even by all agents."""
        if self.spare < 0:
            return True
        all_come = np.bincount(self.task_of_pair, weights=self.weight * self.max_count, minlength=len(self.need))
        return int((all_come >= self.need * MET).sum()) < self.min_served

    def only(self, pairs: IntArray) -> "Demand":
        """Return the constraints restricted to some of the pairs, given by index."""
        return replace(
            self,
            class_of_pair=self.class_of_pair[pairs],
            task_of_pair=self.task_of_pair[pairs],
            weight=self.weight[pairs],
            max_count=self.max_count[pairs],
        )
