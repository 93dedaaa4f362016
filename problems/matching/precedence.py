"""The matchings that serve the most priority, described by groups of agents and tasks, and required tasks."""

from dataclasses import dataclass

import numpy as np

from alloc.problems.fields import BoolArray
from alloc.problems.instance import Instance, IntArray
from alloc.problems.vocabulary import IDLE


@dataclass(frozen=True, eq=False)
class Precedence:
    """The set of matchings of k agents with one competing task each that serve the most priority.

    These are the matchings in which every agent has a task of its group, and every required task has an agent.

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
        """Tasks that are served in some of these matchings."""
        return np.flatnonzero(self.group_of_task != IDLE)

    def allows(self, row: IntArray, task: IntArray) -> BoolArray:
        """Return whether the agent at each row may have its task."""
        allowed: BoolArray = self.group_of_agent[row] == self.group_of_task[task]
        return allowed


def differs(instance: Instance, tasks: IntArray) -> bool:
    """Return whether the priorities of `tasks` differ."""
    return bool(len(tasks) and np.ptp(instance.priority[tasks]) > 0)


def urgent_first(instance: Instance, tasks: IntArray) -> IntArray:
    """Return `tasks` sorted by descending priority, then by ascending workload."""
    return tasks[np.lexsort((instance.workload[tasks], -instance.priority[tasks]))]


def of_first(instance: Instance, tasks: IntArray, k: int) -> Precedence:
    """Return the precedence of `tasks` for k agents that can serve the first k in order of priority."""
    last = np.partition(-instance.priority[tasks], k - 1)[k - 1] if k else -np.inf
    group, required = np.full(instance.m, IDLE, dtype=np.intp), np.zeros(instance.m, dtype=np.bool_)
    group[tasks[-instance.priority[tasks] <= last]] = 0
    required[tasks[-instance.priority[tasks] < last]] = True
    return Precedence(np.zeros(k, dtype=np.intp), group, required)
