"""Cuts over clusters of tasks: a cluster must get whole agents too, which a mixture of groups may not give it.

The agents of each class that a cluster gets in all are a whole solution of a knapsack. Where those of a mixture lie
outside the convex hull of these solutions, a linear function of them is larger than it is at any solution: a cut. It is
sought by Kelley's method: functions that all solutions known satisfy, and the solution that violates the best of them.

References
----------
Boyd (1994), Fenchel cutting planes for integer programs, doi:10.1287/opre.42.1.53.
"""

from collections.abc import Callable
from dataclasses import dataclass

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

TURN = 40
"""Clusters of which cuts are sought before the mixture changes, if there are any cuts."""

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
        The tasks of each cluster.
    """

    def __init__(self, model: EnergyModel, member: Mask) -> None:
        self._model, self._member = model, member
        self._knapsacks: dict[int, EnergyModel] = {}
        self._points: dict[int, FloatArray] = {}
        self._next = 0

    def violated(
        self, use: FloatArray, task: IntArray, part: FloatArray, should_stop: Callable[[], bool]
    ) -> list[ClusterCut]:
        """Return cuts that a mixture violates; clusters take turns, and if those of this turn have none, more do.

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
        turn = [(self._next + f) % len(self._member) for f in range(len(self._member))]
        for begin in range(0, len(turn), TURN):
            for f in turn[begin : begin + TURN]:
                if should_stop():
                    return cuts
                here = self._member[f][task]
                if (part[here] < 1 - 1e-6).any() and self._knapsack(f).need[0] > 0:
                    cuts += self._cut_of(f, part[here] @ use[here])
            self._next += TURN
            if cuts:
                break
        return cuts

    def _knapsack(self, f: int) -> EnergyModel:
        """Return the knapsack of a cluster; built when it is first asked for, as there are many."""
        if f not in self._knapsacks:
            self._knapsacks[f] = Clusters.build(self._model, self._member[f : f + 1]).model
            self._points[f] = self._knapsacks[f].copies[None].astype(float)
        return self._knapsacks[f]

    def _cut_of(self, f: int, mixed: FloatArray) -> list[ClusterCut]:
        """Return a cut of a cluster that has `mixed` agents of each class, shape (k,); none if none is violated."""
        knapsack = self._knapsack(f)
        inside = mixed[knapsack.class_of_pair]
        function = _Separator(inside, self._points[f], is_exact=bool(knapsack.max_weight[0] >= 0))
        best, cuts = LEAST_VIOLATION, []
        for _ in range(MOST_ROUNDS):
            factor, most = function.most_violated()
            if most < max(LEAST_VIOLATION, MUCH_MORE * best):
                break
            point, _, cost = solve_subproblems(knapsack, -factor, compare=False)
            if not np.isfinite(cost):
                break
            violation = float(factor @ inside) + cost
            if violation > best:
                best, whole = violation, np.zeros(len(mixed))
                whole[knapsack.class_of_pair] = factor
                cuts = [ClusterCut(self._member[f], whole, PRECISION - cost)]
            function.add(point.astype(float))
            self._points[f] = np.vstack([self._points[f], point])
        return cuts


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
