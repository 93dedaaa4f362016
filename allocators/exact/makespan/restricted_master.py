"""The configuration linear programme restricted to the groups found so far, solved by HiGHS."""

from collections.abc import Iterator
from dataclasses import dataclass

import highspy
import numpy as np

from alloc.allocators.exact.knapsack import Table, WholeArray, read_group
from alloc.problems.instance import FloatArray, IntArray

CLOSE = 1e-9
"""Gap at which the programme counts as solved, and by which theta may exceed 1 without a proof by prices."""

GROUPS_AT_ONCE = 100
"""Approximate number of groups added at once if there are few rows."""


@dataclass(frozen=True, eq=False)
class TaskNeeds:
    """Needs at some T, in integer steps, of tasks with equal weights of agents.

    Attributes
    ----------
    tasks : ndarray of int, shape (g,)
    weight : ndarray of int64, shape (k,)
        Contribution of one agent of each class.
    need : ndarray of int64, shape (g,)
    """

    tasks: IntArray
    weight: WholeArray
    need: WholeArray


class RestrictedMaster:
    """Minimise theta over the known groups; tasks with equal needs and weights share a row.

    Parameters
    ----------
    tasks : list of TaskNeeds
    count : ndarray of int64, shape (k,)
        Number of agents in each class.

    Attributes
    ----------
    solved : bool
        Whether there is a solution yet.
    theta : float
        The optimal value.
    price : ndarray, shape (k,)
        Dual prices of the classes, with total cost 1 of all agents.
    """

    def __init__(self, tasks: list[TaskNeeds], count: WholeArray) -> None:
        self._rows: list[tuple[int, int, int]] = []  # index into `tasks`, need, number of tasks
        for index, needs in enumerate(tasks):
            values, times = np.unique(needs.need, return_counts=True)
            self._rows += [(index, int(v), int(c)) for v, c in zip(values, times, strict=True)]
        self._tasks, self._count = tasks, count
        self._seen: set[tuple[int, bytes]] = set()
        self.solved, self.theta = False, np.inf
        self.price = self._group_price = np.zeros(0)
        self._highs = highspy.Highs()
        for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
            self._highs.setOptionValue(option, value)
        for _, _, alike in self._rows:
            self._highs.addRow(float(alike), float(alike), 0, np.zeros(0, dtype=np.int32), np.zeros(0))
        for _ in count:
            self._highs.addRow(-highspy.kHighsInf, 0.0, 0, np.zeros(0, dtype=np.int32), np.zeros(0))
        uses = (len(self._rows) + np.arange(len(count))).astype(np.int32)
        self._highs.addCol(1.0, 0.0, highspy.kHighsInf, len(uses), uses, -count.astype(float))

    def add_known(self, group: WholeArray) -> None:
        """Add a group found at another T as a column of the task with the largest need that it meets."""
        done = [int(needs.weight @ group) for needs in self._tasks]
        met = [(need, row) for row, (index, need, _) in enumerate(self._rows) if done[index] >= need]
        if met:
            self._add(max(met)[1], group)

    def add_groups(self, tables: list[Table], price: FloatArray, known: list[WholeArray]) -> bool:
        """Add groups of negative reduced cost, also to `known`; return whether there were any.

        For each row the cheapest group and, if there are few rows, the cheapest ones with an agent of each class.

        Parameters
        ----------
        price : ndarray, shape (k,)
            Prices at which the tables were computed.
        """
        new, most = False, max(1, GROUPS_AT_ONCE // len(self._rows))
        for row, (index, need, _) in enumerate(self._rows):
            for group in self._cheap_groups(self._tasks[index], tables[index], price, need, most):
                if self.solved and group @ self.price >= self._group_price[row] - CLOSE / 10:
                    continue
                if self._add(row, group):
                    known.append(group)
                    new = True
        return new

    def _cheap_groups(
        self, needs: TaskNeeds, table: Table, price: FloatArray, need: int, most: int
    ) -> Iterator[WholeArray]:
        """Yield the cheapest group, then the cheapest ones with an agent of a class, for the classes that add least."""
        classes = len(self._count)
        yield read_group(table, classes, need)
        if most == 1:
            return
        rest = np.maximum(0, need - needs.weight)
        with_one = np.where(needs.weight > 0, table[0][rest] + price, np.inf)
        for k in np.argsort(with_one, kind="stable")[: most - 1].tolist():
            if not np.isfinite(with_one[k]):
                return
            group = read_group(table, classes, rest[k])
            if group[k] < self._count[k]:
                group[k] += 1
                yield group

    def solve(self) -> bool:
        """Solve; return whether that succeeded."""
        self._highs.run()
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return False
        dual = np.asarray(self._highs.getSolution().row_dual)
        self._group_price, self.price = dual[: len(self._rows)], np.maximum(0.0, -dual[len(self._rows) :])
        self.theta, self.solved = self._highs.getInfo().objective_function_value, True
        return True

    def _add(self, row: int, group: WholeArray) -> bool:
        key = (row, group.tobytes())
        if key in self._seen:
            return False
        self._seen.add(key)
        classes = np.flatnonzero(group)
        index = np.append(row, len(self._rows) + classes).astype(np.int32)
        value = np.append(1.0, group[classes]).astype(float)
        self._highs.addCol(0.0, 0.0, highspy.kHighsInf, len(index), index, value)
        return True
