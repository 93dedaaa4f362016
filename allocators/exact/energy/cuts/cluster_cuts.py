"""Cuts over clusters of tasks: a cluster must get integer numbers of agents as well, which mixtures of groups violate.

The total numbers of agents of each class on a cluster are an integer solution of a knapsack. If those of a mixture lie
outside the convex hull of these solutions, some linear function separates them: a cut. It is found by Kelley's method,
which alternates between the best function for the known solutions and the solution that violates it most.

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

MIN_VIOLATION = 0.02
"""Least violation of an added cut, scaled to a largest coefficient of 1."""

MAX_ROUNDS, MUCH_MORE = 40, 1.1
"""Limit on the solutions computed for one cut, and the possible growth of its violation needed to compute more."""

TURN, MAX_CUTS = 60, 40
"""Limits on clusters that are separated, and on cuts found, before the mixture is updated."""

WHOLE, MAX_FRACTIONAL = 1e-6, 30
"""Distance from an integer from which agents count as fractional, and number of fractional classes above which a
cluster is skipped."""

MAX_KNOWN, MAX_SHARING = 2000, 500
"""Limits on the clusters whose knapsacks are cached, and on clusters of tasks that share agents."""

PRECISION = 1e-9
"""Slack added to a cut for rounding errors."""


@dataclass(frozen=True, eq=False)
class ClusterCut:
    """The sum of the factors of a cluster's agents is at most the limit.

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
        """Return the coefficients of groups in the cut, given their agents of each class, shape (g, k), and tasks."""
        return np.asarray(np.where(self.inside[task], use @ self.factor, 0.0))


class ClusterSeparation:
    """Separates violated cuts of clusters.

    Parameters
    ----------
    model : EnergyModel
    member : ndarray of bool, shape (f, t)
        The tasks of each cluster; sets of tasks that share agents in the mixture are added.
    """

    def __init__(self, model: EnergyModel, member: Mask) -> None:
        self._model, self._member = model, member
        self._knapsacks: dict[bytes, EnergyModel] = {}
        self._points: dict[bytes, FloatArray] = {}
        self._turn, self._due, self._pause = 0, dict[bytes, int](), dict[bytes, int]()

    def violated(
        self, use: FloatArray, task: IntArray, part: FloatArray, should_stop: Callable[[], bool]
    ) -> list[ClusterCut]:
        """Return cuts that a mixture violates; clusters with few fractional classes come first.

        Of 341 clusters of an instance with 500 agents and 30 tasks, those with 1 or 2 fractional classes were cut in
        78 % of all cases, those with 3 to 9 in 40 %, and those with 15 or more never, which also took longer.

        Parameters
        ----------
        use : ndarray, shape (g, k)
            Agents of each class in each group.
        task : ndarray of int, shape (g,)
        part : ndarray, shape (g,)
        should_stop : callable
            Called between clusters.
        """
        cuts: list[ClusterCut] = []
        mixed = np.zeros((len(self._model.need), use.shape[1]))
        np.add.at(mixed, task, part[:, None] * use)
        member = self._member
        if len(member):
            member = np.unique(np.vstack([member, sharing_clusters(mixed, MAX_SHARING)]), axis=0)
        broken = (_distance_from_whole(member.astype(float) @ mixed) > WHOLE).sum(axis=1)
        self._turn += 1
        pausing = np.array([self._due.get(inside.tobytes(), 0) > self._turn for inside in member], dtype=bool)
        order, tried = np.lexsort((broken, pausing)), 0
        for f in order[(broken[order] > 0) & (broken[order] <= MAX_FRACTIONAL)].tolist():
            if should_stop() or len(cuts) >= MAX_CUTS or (cuts and (tried >= TURN or pausing[f])):
                break
            if self._knapsack(member[f]).need[0] > 0:
                tried += 1
                found = self._cut_of(member[f], member[f].astype(float) @ mixed)
                self._rest(member[f], found=bool(found))
                cuts += found
        return cuts

    def _rest(self, inside: Mask, *, found: bool) -> None:
        """Skip a cluster without a cut in the next turns, twice as many each time."""
        key = inside.tobytes()
        self._pause[key] = 1 if found else 2 * self._pause.get(key, 1)
        self._due[key] = 0 if found else self._turn + self._pause[key]

    def _knapsack(self, inside: Mask) -> EnergyModel:
        """Return the knapsack of a cluster, built on first use, as there are many."""
        key = inside.tobytes()
        if key not in self._knapsacks:
            if len(self._knapsacks) >= MAX_KNOWN:
                self._knapsacks.clear()
                for known in (self._points, self._due, self._pause):
                    known.clear()
            self._knapsacks[key] = Clusters.build(self._model, inside[None]).model
            self._points[key] = self._knapsacks[key].copies[None].astype(float)
        return self._knapsacks[key]

    def _cut_of(self, inside: Mask, mixed: FloatArray) -> list[ClusterCut]:
        """Return a cut violated by `mixed` agents of each class on a cluster, shape (k,), or no cut."""
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
        """Whether a mixture is a convex combination of solutions; add those found to the points.

        Classes of which the mixture has none, or all, are fixed accordingly in all these solutions, so that a smaller
        knapsack over the other classes decides.
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
    """Return the factors of a violated cut or None, the minimum of its negative use, and known solutions, shape (s, p).

    Parameters
    ----------
    agents : ndarray, shape (p,)
        Agents of each class in the mixture.
    points : ndarray, shape (s, p)
        Initial solutions.
    """
    function = _Separator(agents, points, is_exact=bool(knapsack.max_weight[0] >= 0))
    best, found, limit, known = MIN_VIOLATION, None, 0.0, [points]
    for _ in range(MAX_ROUNDS):
        factor, most = function.most_violated()
        if most < max(MIN_VIOLATION, MUCH_MORE * best):
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
    """Return about `most` clusters, at most, of tasks that share agents in a mixture, shape (f, t).

    Each cluster starts from a task and is extended by the task that shares most agents with it.

    Parameters
    ----------
    mixed : ndarray, shape (t, k)
        Numbers of agents of each class on each task, fractional if shared.
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
    """Return the distances of numbers from the nearest integers."""
    return np.asarray(np.abs(number - np.round(number)))


class _Separator:
    """The linear function with the largest violation by a mixture relative to all known solutions: a linear programme.

    Factors are from -1 to 1, or to 0 if solutions may exceed their need.
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
        """Return the factors and an upper bound on their violation; negative if that is unknown."""
        self._highs.run()
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return np.zeros(len(self._index) - 1), -1.0
        factor = np.array(self._highs.getSolution().col_value)[:-1]
        return factor, -float(self._highs.getInfo().objective_function_value)
