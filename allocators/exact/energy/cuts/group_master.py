"""The restricted master programme over the groups found so far, with cuts; solved by HiGHS."""

from collections.abc import Callable

import highspy
import numpy as np
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.cuts.cluster_cuts import ClusterCut, ClusterSeparation
from alloc.allocators.exact.energy.cuts.subset_rows import violated_sets
from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.knapsack import WholeArray
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import FloatArray, IntArray

MIN_VIOLATION, MAX_FOUND = 0.05, 5000
"""Least violation of an added cut over classes, and limit on the number of violated ones considered."""

MAX_CUTS, MAX_OF_CLASS = 60, 4
"""Limits on cuts over classes added at once, and on those among them with the same class."""

SMALL_GROUP = 12
"""Number of agents per task above which cuts over classes make the search for groups long, and are the last resort."""

DUAL_SIMPLEX, PRIMAL_SIMPLEX = 1, 4
"""Simplex strategies of HiGHS after new cuts, and after new groups only, where the latter takes half the time."""

ROOM, ROOM_FOR_CUTS = 1024, 64
"""Initial capacities for groups and cuts."""

MAX_ENTRIES = 2**25
"""Limit on the entries of the tables of groups by classes and by cuts, a quarter of a gigabyte each."""


class GroupMaster:
    """Minimise the cost of the mixture subject to the limits of each class and each cut.

    Parameters
    ----------
    model : EnergyModel
    member : ndarray of bool, shape (f, t)
        Clusters of tasks whose cuts are separated.

    Attributes
    ----------
    value : float
        Cost of the mixture.
    price : ndarray, shape (k,)
        Dual price of an agent of each class.
    penalty : ndarray, shape (c,)
        Dual price of each cut.
    limit : ndarray, shape (c,)
        Right-hand side of each cut.
    seeks_sets : bool
        Whether cuts over classes are separated.
    """

    def __init__(self, model: EnergyModel, member: Mask) -> None:
        self._model, self._first = model, model.first
        self._tasks, classes = len(model.need), len(model.count)
        self._count = np.append(model.count, 0)
        self._use, self._used = np.zeros((ROOM, classes + 1)), np.zeros((ROOM, ROOM_FOR_CUTS))
        self._task, self._cost, self._groups = np.zeros(ROOM, dtype=np.intp), np.zeros(ROOM), 0
        self._seen: dict[tuple[int, bytes, bytes], int] = {}
        self._sets, self._set_at = np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.intp)
        self.seeks_sets, self._has_small_groups = True, model.count.sum() <= SMALL_GROUP * self._tasks
        self._clusters: list[ClusterCut] = []
        self._cluster_at, self._member = np.zeros(0, dtype=np.intp), member
        self._separation = ClusterSeparation(model, member)
        self._part = np.zeros(0)
        self._scale = 1 / max(1e-300, float(np.abs(model.cost).mean()))
        self.value, self.price = np.inf, np.zeros(classes)
        self.penalty, self.limit = np.zeros(0), np.zeros(0)
        self._highs, self._cuts_known = highspy.Highs(), 0
        self._highs.HandleUserInterrupt = True
        for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
            self._highs.setOptionValue(option, value)
        for _ in range(self._tasks):
            self._add_row(1.0, 1.0, np.zeros(0))
        for least, most in zip(model.min_agents.tolist(), model.count.tolist(), strict=True):
            self._add_row(least if least > 0 else -highspy.kHighsInf, most, np.zeros(0))

    def add(self, group: WholeArray) -> bool:
        """Add the non-empty group of each task, given by pairs, shape (p,); return whether any is new.

        Groups that exceed the memory limit are not added, which only weakens the bound.
        """
        is_new = False
        for j in range(self._tasks):
            a, b = self._first[j], self._first[j + 1]
            inside = a + np.flatnonzero(group[a:b])
            key = j, self._model.class_of_pair[inside].tobytes(), group[inside].tobytes()
            if len(inside) == 0:
                continue
            g = self._seen.get(key)
            if g is None and self._has_room():
                self._seen[key], is_new = self._groups, True
                self._add_group(j, inside, group[inside])
            elif g is not None and not np.isfinite(self._cost[g]):  # it was left out
                self._cost[g], is_new = self._model.cost[inside] @ group[inside], True
                self._highs.changeColBounds(g, 0.0, highspy.kHighsInf)
        return is_new

    def _has_room(self, *, cut: bool = False) -> bool:
        """Whether there is room for another group or cut; enlarge the tables if memory allows."""
        rows, cuts = self._used.shape
        more_groups, more_cuts = not cut and self._groups == rows, cut and len(self.limit) == cuts
        if (1 + more_groups) * rows * max(self._use.shape[1], (1 + more_cuts) * cuts) > MAX_ENTRIES:
            return not (more_groups or more_cuts)
        if more_groups:
            self._use, self._used, self._task, self._cost = (
                np.concatenate([known, np.zeros_like(known)])
                for known in (self._use, self._used, self._task, self._cost)
            )
        if more_cuts:
            self._used = np.hstack([self._used, np.zeros_like(self._used)])
        return True

    def restrict(self, model: EnergyModel) -> None:
        """Restrict the programme to a model with only some of the pairs, and to groups of these."""
        self._model, self._first = model, model.first
        stay = np.zeros((self._tasks, len(model.count)), dtype=bool)
        stay[model.task_of_pair, model.class_of_pair] = True
        known = slice(self._groups)
        lost = (self._use[known, :-1] > 0) & ~stay[self._task[known]]
        self._leave_out(np.asarray(lost.any(axis=1)))
        self._separation = ClusterSeparation(model, self._member)

    def leave_out_dear(self, price: FloatArray, penalty: FloatArray, least: FloatArray, more: float) -> None:
        """Leave out unused groups whose cost at some prices exceeds the least, shape (t,), by `more`.

        No better plan uses them, and the programme is solved faster without them. Pricing may bring them back.
        """
        known = slice(len(self._part))
        cost = self._paid(known, price, penalty)
        self._leave_out((cost - least[self._task[known]] > more) & (self._part <= 0))

    def _paid(self, known: slice, price: FloatArray, penalty: FloatArray) -> FloatArray:
        """Return the costs of groups at prices of agents and penalties of the first cuts."""
        paid: FloatArray = self._cost[known] + self._use[known, :-1] @ price
        return paid + self._used[known, : len(penalty)] @ penalty

    def _leave_out(self, groups: Mask) -> None:
        for g in np.flatnonzero(groups & np.isfinite(self._cost[: len(groups)])).tolist():
            self._cost[g] = np.inf
            self._highs.changeColBounds(g, 0.0, 0.0)

    def solve(self, should_stop: Callable[[], bool]) -> bool:
        """Solve the programme; return whether that succeeded, which it does not if stopped."""
        only_groups = self._cuts_known == len(self.limit)  # then the last basis still has a mixture
        self._highs.setOptionValue("simplex_strategy", PRIMAL_SIMPLEX if only_groups else DUAL_SIMPLEX)
        self._cuts_known = len(self.limit)
        run_native(self._highs.solve, should_stop, self._highs.cancelSolve)
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
        """Return the cost of the cheapest known group of each task at some prices, shape (t,)."""
        known, least = slice(self._groups), np.full(self._tasks, np.inf)
        cost = self._paid(known, price, penalty)
        np.minimum.at(least, self._task[known], cost)
        return least

    @property
    def mixture(self) -> FloatArray:
        """Agents of each pair in the last mixture, shape (p,)."""
        known, model = slice(len(self._part)), self._model
        mixed = np.zeros((self._tasks, len(model.count)))
        np.add.at(mixed, self._task[known], self._part[:, None] * self._use[known, :-1])
        return np.asarray(mixed[model.task_of_pair, model.class_of_pair])

    def fees(self, penalty: FloatArray) -> FloatArray:
        """Return the penalties of cluster cuts for an agent of each pair, shape (p,)."""
        model, fee = self._model, np.zeros((self._tasks, len(self._model.count)))
        for at, cut in zip(self._cluster_at.tolist(), self._clusters, strict=True):
            if penalty[at] > 0:
                fee[cut.inside] += penalty[at] * cut.factor
        return fee[model.task_of_pair, model.class_of_pair]

    def cuts_of_pairs(self, penalty: FloatArray) -> tuple[WholeArray, WholeArray]:
        """Return the cuts over classes with a penalty of each pair, as start indices, shape (p + 1,), and a list."""
        on = np.flatnonzero(penalty[self._set_at])
        entry = (np.ones(3 * len(on)), (self._sets[on].ravel(), np.repeat(self._set_at[on], 3)))
        table = csr_array(entry, shape=(len(self._count), max(1, len(penalty))))[self._model.class_of_pair]
        return table.indptr.astype(np.int64), table.indices.astype(np.int64)

    @property
    def sets(self) -> IntArray:
        """Indices of the cuts over classes."""
        return self._set_at

    def used(self, task: IntArray, use: FloatArray) -> FloatArray:
        """Return the coefficients of groups in each cut, shape (g, c), given their tasks and agents of each class."""
        used, padded = np.zeros((len(task), len(self.limit))), np.hstack([use, np.zeros((len(task), 1))])
        used[:, self._set_at] = sum(padded[:, members] for members in self._sets.T) // 2
        for at, cut in zip(self._cluster_at.tolist(), self._clusters, strict=True):
            used[:, at] = cut.use(use, task)
        return used

    def separate(self, should_stop: Callable[[], bool]) -> bool:
        """Add the cuts that the mixture violates most, within time and memory; return whether there are any."""
        before = len(self.limit)
        on = np.flatnonzero(self._part > 1e-6)
        for cut in self._separation.violated(self._use[on, :-1], self._task[on], self._part[on], should_stop):
            if not self._has_room(cut=True):
                return len(self.limit) > before
            self._cluster_at = np.append(self._cluster_at, len(self.limit))
            self._clusters.append(cut)
            self._add_cut(cut.limit, cut.use(self._use[: self._groups, :-1], self._task[: self._groups]))
        if self.seeks_sets and (self._has_small_groups or len(self.limit) == before):
            self._separate_sets(on)
        return len(self.limit) > before

    def leave_out_sets(self) -> IntArray:
        """Remove the cuts over classes, separate no more of them, and return their indices."""
        self.seeks_sets, first, sets = False, self._tasks + len(self._model.count), self._set_at
        for row in (first + self._set_at).tolist():
            self._highs.changeRowBounds(row, -highspy.kHighsInf, highspy.kHighsInf)
        self._sets, self._set_at = self._sets[:0], self._set_at[:0]
        return sets

    def _separate_sets(self, on: IntArray) -> None:
        use = np.ascontiguousarray(self._use[on].T.astype(np.int64))
        sets, excess = violated_sets(use, self._part[on], self._count, MIN_VIOLATION, MAX_FOUND)
        times, new = np.zeros(len(self._count)), 0
        for row in np.argsort(-excess, kind="stable").tolist():
            members = sets[row][self._count[sets[row]] > 0]
            if new < MAX_CUTS and (times[members] < MAX_OF_CLASS).all() and self._has_room(cut=True):
                times[members] += 1
                new += 1
                self._sets, self._set_at = np.vstack([self._sets, sets[row]]), np.append(self._set_at, len(self.limit))
                self._add_cut(self._count[members].sum() // 2, self._use[: self._groups, members].sum(axis=1) // 2)

    def _add_cut(self, limit: float, used: FloatArray) -> None:
        self._used[: self._groups, len(self.limit)] = used
        self.limit = np.append(self.limit, limit)
        self._add_row(-highspy.kHighsInf, limit, used)

    def _add_row(self, least: float, most: float, entries: FloatArray) -> None:
        columns = np.flatnonzero(entries)
        value = entries[columns].astype(float)
        self._highs.addRow(float(least), float(most), len(columns), columns.astype(np.int32), value)

    def _add_group(self, task: int, pairs: IntArray, agents: WholeArray) -> None:
        g, classes = self._groups, len(self._model.count)
        use = self._use[g]
        use[self._model.class_of_pair[pairs]] = agents
        self._task[g], self._cost[g] = task, self._model.cost[pairs] @ agents
        self._used[g, : len(self.limit)] = self.used(self._task[g : g + 1], use[None, :-1])
        self._groups += 1
        column = np.concatenate([use[:classes], self._used[g, : len(self.limit)]])
        rows = np.flatnonzero(column)
        index = np.append(task, self._tasks + rows).astype(np.int32)
        value = np.append(1, column[rows]).astype(float)
        self._highs.addCol(float(self._cost[g]) * self._scale, 0.0, highspy.kHighsInf, len(index), index, value)
