"""The linear programme that mixes the groups of each task found so far, with cuts over sets of classes, by HiGHS."""

import highspy
import numpy as np
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.cuts.subset_rows import violated_sets
from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray, IntArray

LEAST_VIOLATION, MOST_FOUND = 0.05, 5000
"""Violation from which a cut is added, and how many such are looked at."""

MOST_CUTS, MOST_OF_CLASS = 60, 4
"""Cuts added at once, and of these how many with the same class."""

ROOM = 1024
"""Groups for which there is room at first."""


class GroupMaster:
    """Minimise what the mixture costs such that its use of each class and each cut is within limits.

    Parameters
    ----------
    model : EnergyModel
        Costs may be any, also below 0.

    Attributes
    ----------
    value : float
        Cost of the mixture.
    price : ndarray, shape (k,)
        Of one agent of each class.
    penalty : ndarray, shape (c,)
        Of each cut.
    """

    def __init__(self, model: EnergyModel) -> None:
        self._model, self._first = model, model.first
        self._tasks, classes = len(model.need), len(model.count)
        self._count = np.append(model.count, 0)
        self._use = np.zeros((ROOM, classes + 1))
        self._task, self._cost, self._groups = np.zeros(ROOM, dtype=np.intp), np.zeros(ROOM), 0
        self._seen: set[bytes] = set()
        self._sets = np.zeros((0, 3), dtype=np.int64)
        self._part = np.zeros(0)
        self._scale = 1 / max(1e-300, float(np.abs(model.cost).mean()))
        self.value, self.price, self.penalty = np.inf, np.zeros(classes), np.zeros(0)
        self._highs = highspy.Highs()
        for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
            self._highs.setOptionValue(option, value)
        for _ in range(self._tasks):
            self._add_row(1.0, 1.0, np.zeros(0))
        for least, most in zip(model.min_agents.tolist(), model.count.tolist(), strict=True):
            self._add_row(least if least > 0 else -highspy.kHighsInf, most, np.zeros(0))

    @property
    def limit_of_cut(self) -> IntArray:
        """How many pairs of agents all groups can have of the set of each cut, shape (c,)."""
        return np.asarray(self._count[self._sets].sum(axis=1) // 2)

    def add(self, group: WholeArray) -> bool:
        """Add the group of each task, given by pairs, shape (p,), unless it is empty; return whether any is new."""
        before = self._groups
        for j in range(self._tasks):
            a, b = self._first[j], self._first[j + 1]
            inside = a + np.flatnonzero(group[a:b])
            key = inside.tobytes() + group[inside].tobytes()
            if len(inside) and key not in self._seen:
                self._seen.add(key)
                self._add_group(j, inside, group[inside])
        return self._groups > before

    def solve(self) -> bool:
        """Solve; return whether that succeeded."""
        self._highs.run()
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return False
        solution, model = self._highs.getSolution(), self._model
        dual = -np.asarray(solution.row_dual) / self._scale
        price, self.penalty = np.split(dual[self._tasks :], [len(model.count)])
        self.price = np.where(model.min_agents > 0, price, np.maximum(price, 0.0))
        self.penalty = np.maximum(self.penalty, 0.0)
        self._part = np.asarray(solution.col_value)
        self.value = self._highs.getInfo().objective_function_value / self._scale
        return True

    def cheapest(self, price: FloatArray, penalty: FloatArray) -> FloatArray:
        """Return the cost of the cheapest group known of each task at some prices, shape (t,)."""
        use, least = self._use[: self._groups], np.full(self._tasks, np.inf)
        cost = self._cost[: self._groups] + use[:, :-1] @ price
        on = np.flatnonzero(penalty)
        for members, fine in zip(self._sets[on], penalty[on].tolist(), strict=True):
            cost += fine * (use[:, members].sum(axis=1) // 2)
        np.minimum.at(least, self._task[: self._groups], cost)
        return least

    def cuts_of_pairs(self, penalty: FloatArray) -> tuple[WholeArray, WholeArray]:
        """Return where the cuts of each pair begin, shape (p + 1,), and these cuts, if they have a penalty."""
        on = np.flatnonzero(penalty)
        entry = (np.ones(3 * len(on)), (self._sets[on].ravel(), np.repeat(on, 3)))
        table = csr_array(entry, shape=(len(self._count), max(1, len(penalty))))[self._model.class_of_pair]
        return table.indptr.astype(np.int64), table.indices.astype(np.int64)

    def separate(self) -> bool:
        """Add the cuts that the mixture violates most; return whether there are any."""
        on = np.flatnonzero(self._part > 1e-6)
        use = np.ascontiguousarray(self._use[on].T.astype(np.int64))
        sets, excess = violated_sets(use, self._part[on], self._count, LEAST_VIOLATION, MOST_FOUND)
        times = np.zeros(len(self._count))
        new: list[WholeArray] = []
        for row in np.argsort(-excess, kind="stable").tolist():
            members = sets[row][self._count[sets[row]] > 0]
            if len(new) < MOST_CUTS and (times[members] < MOST_OF_CLASS).all():
                times[members] += 1
                new.append(sets[row])
        for members in new:
            halves = self._use[: self._groups, members].sum(axis=1) // 2
            self._add_row(-highspy.kHighsInf, self._count[members].sum() // 2, halves)
        self._sets = np.vstack([self._sets, *new])
        return len(new) > 0

    def _add_row(self, least: float, most: float, entries: FloatArray | IntArray) -> None:
        columns = np.flatnonzero(entries)
        value = entries[columns].astype(float)
        self._highs.addRow(float(least), float(most), len(columns), columns.astype(np.int32), value)

    def _add_group(self, task: int, pairs: IntArray, agents: WholeArray) -> None:
        g, classes = self._groups, len(self._model.count)
        if g == len(self._use):
            self._use, self._task, self._cost = (
                np.concatenate([known, np.zeros_like(known)]) for known in (self._use, self._task, self._cost)
            )
        use = self._use[g]
        use[self._model.class_of_pair[pairs]] = agents
        self._task[g], self._cost[g] = task, self._model.cost[pairs] @ agents
        self._groups += 1
        column = np.concatenate([use[:classes], use[self._sets].sum(axis=1) // 2])
        rows = np.flatnonzero(column)
        index = np.append(task, self._tasks + rows).astype(np.int32)
        value = np.append(1, column[rows]).astype(float)
        self._highs.addCol(float(self._cost[g]) * self._scale, 0.0, highspy.kHighsInf, len(index), index, value)
