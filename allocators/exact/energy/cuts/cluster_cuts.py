"""Cuts over clusters of tasks: a cluster must get whole agents too, which a mixture of groups may not give it.

The agents of each class that a cluster gets in all are a whole solution of a knapsack. Where those of a mixture lie
outside the convex hull of these solutions, a linear function of them is larger than it is at any solution: a cut. It is
sought by Kelley's method: functions that all solutions known satisfy, and the solution that violates the best of them.

References
----------
Boyd (1994), Fenchel cutting planes for integer programs, doi:10.1287/opre.42.1.53.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import highspy
import numpy as np

from alloc.allocators.exact.energy.clusters import Clusters
from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.energy.subproblems import solve_subproblems
from alloc.problems.instance import FloatArray, IntArray

LEAST_VIOLATION = 0.02
"""Violation from which a cut is added, where its largest factor is 1."""

MOST_ROUNDS, MUCH_MORE = 40, 1.1
"""Solutions sought for one cut, and by which factor its violation may still grow for more to be sought."""

TURN, MOST_CUTS = 60, 40
"""Clusters of which cuts are sought, and cuts of them, before the mixture changes, if there are any cuts."""

WHOLE, MOST_BROKEN = 1e-6, 30
"""Distance from a whole number from which agents count as broken up, and classes of such agents above which a cluster
is left out."""

MOST_KNOWN, MOST_SHARING = 2000, 500
"""Clusters whose knapsacks are kept, and clusters of tasks that share agents, at the most."""

PRECISION = 1e-9
"""By how much a cut is loosened for rounding."""


@dataclass(frozen=True, eq=False)
class ClusterCut:
    """The agents of a cluster, each times the factor of its class, sum to the limit at the most.

    Attributes
    ----------
    inside : ndarray of bool, shape (t,)
        Tasks of the cluster.
    factor : ndarray, shape (k,)
    limit : float
    """

    inside: Mask
    factor: FloatArray
    limit: float

    def use(self, use: FloatArray, task: IntArray) -> FloatArray:
        """Return what groups use of the cut, given their agents of each class, shape (g, k), and their tasks."""
        return np.asarray(np.where(self.inside[task], use @ self.factor, 0.0))


class ClusterSeparation:
    """Seeks violated cuts of clusters.

    Parameters
    ----------
    model : EnergyModel
    member : ndarray of bool, shape (f, t)
        The tasks of each cluster; those that share agents in the mixture are clusters as well.
    """

    def __init__(self, model: EnergyModel, member: Mask) -> None:
        self._model, self._member = model, member
        self._knapsacks: dict[bytes, EnergyModel] = {}
        self._points: dict[bytes, FloatArray] = {}
        self._turn, self._due, self._pause = 0, dict[bytes, int](), dict[bytes, int]()

    def violated(
        self, use: FloatArray, task: IntArray, part: FloatArray, should_stop: Callable[[], bool]
    ) -> list[ClusterCut]:
        """Return cuts that a mixture violates, of clusters that break up few agents first: theirs are cut most often.

        Of 341 clusters of an instance with 500 agents and 30 tasks, those that have parts of agents of 1 or 2 classes
        were cut in 78 % of all cases, with 3 to 9 classes in 40 %, with 15 or more in none, and took longer.

        Parameters
        ----------
        use : ndarray, shape (g, k)
            Agents of each class in each group.
        task : ndarray of int, shape (g,)
        part : ndarray, shape (g,)
        should_stop : callable
            Asked between clusters.
        """
        cuts: list[ClusterCut] = []
        mixed = np.zeros((len(self._model.need), use.shape[1]))
        np.add.at(mixed, task, part[:, None] * use)
        member = self._member
        if len(member):
            member = np.unique(np.vstack([member, sharing_clusters(mixed, MOST_SHARING)]), axis=0)
        broken = (_distance_from_whole(member.astype(float) @ mixed) > WHOLE).sum(axis=1)
        self._turn += 1
        pausing = np.array([self._due.get(inside.tobytes(), 0) > self._turn for inside in member], dtype=bool)
        order, tried = np.lexsort((broken, pausing)), 0
        for f in order[(broken[order] > 0) & (broken[order] <= MOST_BROKEN)].tolist():
            if should_stop() or len(cuts) >= MOST_CUTS or (cuts and (tried >= TURN or pausing[f])):
                break
            if self._knapsack(member[f]).need[0] > 0:
                tried += 1
                found = self._cut_of(member[f], member[f].astype(float) @ mixed)
                self._rest(member[f], found=bool(found))
                cuts += found
        return cuts

    def _rest(self, inside: Mask, *, found: bool) -> None:
        """Leave a cluster without a cut out of the next turns, twice as many each time."""
        key = inside.tobytes()
        self._pause[key] = 1 if found else 2 * self._pause.get(key, 1)
        self._due[key] = 0 if found else self._turn + self._pause[key]

    def _knapsack(self, inside: Mask) -> EnergyModel:
        """Return the knapsack of a cluster; built when it is first asked for, as there are many."""
        key = inside.tobytes()
        if key not in self._knapsacks:
            if len(self._knapsacks) >= MOST_KNOWN:
                self._knapsacks.clear()
                for known in (self._points, self._due, self._pause):
                    known.clear()
            self._knapsacks[key] = Clusters.build(self._model, inside[None]).model
            self._points[key] = self._knapsacks[key].copies[None].astype(float)
        return self._knapsacks[key]

    def _cut_of(self, inside: Mask, mixed: FloatArray) -> list[ClusterCut]:
        """Return a cut of a cluster that has `mixed` agents of each class, shape (k,); none if none is violated."""
        knapsack, key = self._knapsack(inside), inside.tobytes()
        agents = mixed[knapsack.class_of_pair]
        if self._is_whole(knapsack, key, agents):
            return []
        factor, cost, self._points[key] = _most_violated(knapsack, agents, self._points[key])
        if factor is None:
            return []
        whole = np.zeros(len(mixed))
        whole[knapsack.class_of_pair] = factor
        return [ClusterCut(inside, whole, PRECISION - cost)]

    def _is_whole(self, knapsack: EnergyModel, key: bytes, agents: FloatArray) -> bool:
        """Whether a mixture is one of solutions, as a smaller knapsack shows; add those found to the points.

        A mixture of solutions with none, or all, of a class is one of solutions with none, or all. So only the other
        classes, those that are open, count.
        """
        is_open, ends = (agents > WHOLE) & (agents < knapsack.copies - WHOLE), np.round(agents)
        points, done = self._points[key], int(knapsack.weight[~is_open] @ ends[~is_open])
        is_exact = bool(knapsack.max_weight[0] >= 0)
        most = knapsack.max_weight - done if is_exact else knapsack.max_weight
        if is_exact and most[0] < 0:
            return False
        smaller = replace(knapsack.only(is_open), need=np.maximum(knapsack.need - done, 0), max_weight=most)
        there = points[(points == ends)[:, ~is_open].all(axis=1)][:, is_open]
        if len(there) == 0:
            point, _, cost = solve_subproblems(smaller, np.zeros(int(is_open.sum())), compare=False)
            if not np.isfinite(cost):
                return False
            there = point[None].astype(float)
        factor, _, solutions = _most_violated(smaller, agents[is_open], there)
        new = np.tile(ends, (len(solutions) - len(there), 1))
        new[:, is_open] = solutions[len(there) :]
        self._points[key] = np.vstack([points, new])
        return factor is None


def _most_violated(
    knapsack: EnergyModel, agents: FloatArray, points: FloatArray
) -> tuple[FloatArray | None, float, FloatArray]:
    """Return factors of a violated cut, or None, the least of minus its use, and solutions known, shape (s, p).

    Parameters
    ----------
    agents : ndarray, shape (p,)
        Of each class in the mixture.
    points : ndarray, shape (s, p)
        Solutions to begin with.
    """
    function = _Separator(agents, points, is_exact=bool(knapsack.max_weight[0] >= 0))
    best, found, limit, known = LEAST_VIOLATION, None, 0.0, [points]
    for _ in range(MOST_ROUNDS):
        factor, most = function.most_violated()
        if most < max(LEAST_VIOLATION, MUCH_MORE * best):
            break
        point, _, cost = solve_subproblems(knapsack, -factor, compare=False)
        if not np.isfinite(cost):
            break
        violation = float(factor @ agents) + cost
        if violation > best:
            best, found, limit = violation, factor, cost
        known.append(point[None].astype(float))
        function.add(known[-1][0])
    return found, limit, np.vstack(known)


def sharing_clusters(mixed: FloatArray, most: int) -> Mask:
    """Return clusters of tasks that share agents in a mixture, shape (f, t), at most about as many as given.

    Each task is joined, one after another, by the task with which those so far share the most.

    Parameters
    ----------
    mixed : ndarray, shape (t, k)
        Agents of each class on each task, parts of which are shared.
    most : int
    """
    tasks = len(mixed)
    part = _distance_from_whole(mixed)
    shared = part @ part.T
    inside, rows, each = np.eye(tasks, dtype=bool), [], np.arange(tasks)
    for _ in range(min(tasks // 2, 1 + most // tasks)):
        strength = np.where(inside, -1.0, inside.astype(float) @ shared)
        joining = strength.argmax(axis=1)
        joins = strength[each, joining] > WHOLE
        inside = inside.copy()
        inside[each[joins], joining[joins]] = True
        rows.append(inside[joins])
    return np.vstack([np.zeros((0, tasks), dtype=bool), *rows])


def _distance_from_whole(number: FloatArray) -> FloatArray:
    """Return how far numbers are from the nearest whole ones."""
    return np.asarray(np.abs(number - np.round(number)))


class _Separator:
    """The linear function whose value at a mixture exceeds that at all solutions known by most: a linear programme.

    Factors are from -1 to 1, or to 0 where solutions may be larger than is needed.
    """

    def __init__(self, mixed: FloatArray, points: FloatArray, *, is_exact: bool) -> None:
        size, infinite = len(mixed), highspy.kHighsInf
        self._index = np.arange(size + 1, dtype=np.int32)
        self._highs = highspy.Highs()
        for option, value in (("output_flag", False), ("threads", 1), ("presolve", "off")):
            self._highs.setOptionValue(option, value)
        lp = highspy.HighsLp()
        lp.num_col_, lp.num_row_ = size + 1, 0
        lp.col_cost_ = np.append(-mixed, 1.0)
        lp.col_lower_ = np.append(np.full(size, -1.0), -infinite)
        lp.col_upper_ = np.append(np.full(size, 1.0 if is_exact else 0.0), infinite)
        lp.a_matrix_.start_ = np.zeros(size + 2, dtype=np.int32)
        self._highs.passModel(lp)
        for point in points:
            self.add(point)

    def add(self, point: FloatArray) -> None:
        """Add a solution."""
        self._highs.addRow(0.0, highspy.kHighsInf, len(self._index), self._index, np.append(-point, 1.0))

    def most_violated(self) -> tuple[FloatArray, float]:
        """Return the factors and by how much they may be violated; less than 0 where that cannot be said."""
        self._highs.run()
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return np.zeros(len(self._index) - 1), -1.0
        factor = np.array(self._highs.getSolution().col_value)[:-1]
        return factor, -float(self._highs.getInfo().objective_function_value)
