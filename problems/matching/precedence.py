"""Which matchings serve the most priority, as groups of agents and tasks, and tasks that are required."""

from dataclasses import dataclass

import numpy as np

from alloc.problems.fields import BoolArray
from alloc.problems.instance import Instance, IntArray
from alloc.problems.vocabulary import IDLE


@dataclass(frozen=True, eq=False)
class Precedence:
    """Which matchings of k agents with one competing task each serve the most priority.

    Those in which every agent has a task of its own group, and every required task has an agent.

    Attributes
    ----------
    group_of_agent : ndarray of int, shape (k,)
    group_of_task : ndarray of int, shape (m,)
        `IDLE` for tasks that are not served.
    required : ndarray of bool, shape (m,)
    """

    group_of_agent: IntArray
    group_of_task: IntArray
    required: BoolArray

    @property
    def tasks(self) -> IntArray:
        """The tasks that are served in some such matching."""
        return np.flatnonzero(self.group_of_task != IDLE)

    def allows(self, row: IntArray, task: IntArray) -> BoolArray:
        """Whether the agent at each of these rows may have the task beside it."""
        allowed: BoolArray = self.group_of_agent[row] == self.group_of_task[task]
        return allowed


def differs(instance: Instance, tasks: IntArray) -> bool:
    """Whether some of `tasks` have more priority than others."""
    return bool(len(tasks) and np.ptp(instance.priority[tasks]) > 0)


def urgent_first(instance: Instance, tasks: IntArray) -> IntArray:
    """Return `tasks` in the order of descending priority, then of ascending workload."""
    return tasks[np.lexsort((instance.workload[tasks], -instance.priority[tasks]))]


def of_first(instance: Instance, tasks: IntArray, k: int) -> Precedence:
    """Return the precedence of `tasks` for k agents who can serve the first k in the order of priority."""
    last = np.partition(-instance.priority[tasks], k - 1)[k - 1] if k else -np.inf
    group, required = np.full(instance.m, IDLE, dtype=np.intp), np.zeros(instance.m, dtype=np.bool_)
    group[tasks[-instance.priority[tasks] <= last]] = 0
    required[tasks[-instance.priority[tasks] < last]] = True
    return Precedence(np.zeros(k, dtype=np.intp), group, required)
