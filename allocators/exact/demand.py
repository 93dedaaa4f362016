"""The constraints at a fixed makespan T: what each agent adds, what each task needs, how many agents there are."""

from dataclasses import dataclass, replace

import numpy as np

from alloc.problems.instance import FloatArray, IntArray

MET = 1 - 1e-9
"""Part of a need at which the need counts as met, so that rounding rules out no T."""


@dataclass(frozen=True, eq=False)
class Demand:
    """Data of the constraints (work) and (agents) of `exact.model` at T; pairs that are of no use are left out.

    Attributes
    ----------
    time : float
        T in hours.
    class_of_pair, task_of_pair : ndarray of int, shape (p,)
        Class, and row in `need`, of each pair: k and j of its variable x_kj.
    weight : ndarray, shape (p,)
        What one agent of the class adds to the task, at most its need.
    max_count : ndarray of int, shape (p,)
        Upper bound of the variable: agents of the class that the task could use.
    need : ndarray, shape (t,)
        Least sum of weights of each task.
    count : ndarray of int, shape (k,)
        Agents in each class.
    min_served : int
        How many of the tasks must be served: all, t, unless too few agents can reach them.
    integral : bool
        Whether weights and needs are integers.
    spare : float
        Ability beyond the sum of all needs, in their unit; ``inf`` where it is not known.
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
        """Largest sum of weights of each task that leaves enough ability to the others, shape (t,)."""
        return self.need + self.spare

    @property
    def min_agents(self) -> IntArray:
        """How many of each class must work, as the needs exceed the ability of the others, shape (k,)."""
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
        """Whether all abilities together are too small, or too many tasks fall short even if all agents come."""
        if self.spare < 0:
            return True
        all_come = np.bincount(self.task_of_pair, weights=self.weight * self.max_count, minlength=len(self.need))
        return int((all_come >= self.need * MET).sum()) < self.min_served

    def only(self, pairs: IntArray) -> "Demand":
        """Return the constraints with some of the pairs, given by index."""
        return replace(
            self,
            class_of_pair=self.class_of_pair[pairs],
            task_of_pair=self.task_of_pair[pairs],
            weight=self.weight[pairs],
            max_count=self.max_count[pairs],
        )
