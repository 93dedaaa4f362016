"""The configuration linear programme: which groups tasks would take if groups could be mixed.

At a fixed T, a *group* covers a task if its agents have done the work by then. The programme mixes groups for tasks,
weights summing to 1, such that the busiest class of agents is used as little as possible:

    minimise theta:  sum_p x_jp = 1 for each task j,   sum_jp agents_pk x_jp <= theta count_k for each class k.

If theta > 1, there is no plan. Groups are found as they are needed, by a knapsack at the prices of the classes
(column generation). For any prices >= 0, theta is at least what the cheapest groups of all tasks cost together, over
what all agents cost together: that comparison, in whole numbers, is the proof; the programme only finds the prices.

References
----------
Azar and Epstein (1998), On-line machine covering, doi:10.1002/(SICI)1099-1425(199808)1:2<67::AID-JOS6>3.0.CO;2-Y.
Gilmore and Gomory (1961), A linear programming approach to the cutting-stock problem, doi:10.1287/opre.9.6.849.
"""

from collections.abc import Callable
from dataclasses import dataclass

import highspy
import numpy as np

from alloc.allocators.exact.makespan.patterns import Table, WholeArray, fill_table, read_group
from alloc.allocators.exact.model import Model
from alloc.problems.instance import FloatArray, IntArray

MOST_NEED = 20_000
"""Largest need in units up to which these are kept as they are."""

GRID = 8192
"""Steps of the largest need otherwise: what agents add is rounded up to them, what tasks need is rounded down."""

MOST_CELLS = 30_000_000
"""Agents times steps times tables beyond which prices are not tried at all."""

PRICES = 2.0**40
"""What all agents cost together, about; prices are whole, so that sums of them are exact."""

SMOOTH = 0.6
"""Part of the best prices so far in those that are tried next."""

CLOSE = 1e-9
"""Gap at which the programme counts as solved, and by which theta may exceed 1 without a proof to come."""


@dataclass(frozen=True, eq=False)
class Needs:
    """What tasks that can use the same agents alike need at some T, in whole steps.

    Attributes
    ----------
    tasks : ndarray of int, shape (g,)
    weight : ndarray of int64, shape (k,)
        What one agent of each class adds.
    need : ndarray of int64, shape (g,)
    """

    tasks: IntArray
    weight: WholeArray
    need: WholeArray


@dataclass(frozen=True, eq=False)
class Prices:
    """Prices of the classes, whole numbers, shape (k,), and the part theta of all that the cheapest groups cost."""

    price: FloatArray
    theta: float


class Configurations:
    """Tells which T are impossible by prices, and remembers prices and groups for the next T.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low : float
        Hours; no smaller T will be asked for.

    Attributes
    ----------
    count : ndarray of int64, shape (k,)
        Agents in each class.
    able : bool
        Whether the model is of a size for this.
    """

    def __init__(self, model: Model, low: float) -> None:
        self._model = model
        _, need = model.uncapped(low)
        self._step = 1.0 if model.unit is not None and need.max() <= MOST_NEED else float(need.max()) / GRID
        mask = model.classes.mask[:, model.tasks]
        if model.delay is None:
            _, group = np.unique(mask, axis=1, return_inverse=True)
            group = group.reshape(-1)
        else:
            group = np.arange(len(model.tasks))
        self._groups = [np.flatnonzero(group == g) for g in range(group.max() + 1)]
        self.count = model.classes.count.astype(np.int64)
        agents = int(np.minimum(self.count, GRID).sum())
        self.able = bool(agents * need.max() / self._step * len(self._groups) <= MOST_CELLS)
        self._known: list[WholeArray] = []

    def needs(self, time: float) -> list[Needs]:
        """Return what the tasks need at T = `time`, rounded such that what is impossible so is impossible indeed."""
        able, need = self._model.uncapped(time)
        if self._step == 1.0:
            whole, most = able.astype(np.int64), need.astype(np.int64)
        else:
            whole = np.ceil(able / self._step).astype(np.int64)
            most = np.maximum(1, np.floor(need / self._step * (1 - 1e-12))).astype(np.int64)
        return [Needs(tasks, whole[:, tasks[0]], most[tasks]) for tasks in self._groups]

    def reach_of(self, prices: Prices, low: float, high: float) -> float:
        """Return the largest T from `low` to `high`, or close to it, that these prices prove impossible, else `low`."""
        if self._model.delay is not None:
            return low
        every, total = self.needs(low), float(prices.price @ self.count)
        costs = [self._table(needs, prices.price)[0] for needs in every]

        def impossible(time: float) -> bool:
            found = self.needs(time)
            return bool(sum(cost[each.need].sum() for cost, each in zip(costs, found, strict=True)) > total)

        proven = low
        while high - low > 1e-10 * high:
            middle = (low + high) / 2
            if impossible(middle):
                low = proven = middle
            else:
                high = middle
        return proven

    def best_prices(
        self, time: float, should_stop: Callable[[], bool], *, converge: bool = False
    ) -> tuple[Prices | None, bool]:
        """Solve the programme at T = `time`, as far as it takes to see whether T is impossible.

        Parameters
        ----------
        converge : bool
            Whether to go on to the end where it is not.

        Returns
        -------
        Prices or None
            The best ones met; a theta > 1 proves T impossible. ``inf`` if a task cannot be covered by all agents.
        bool
            Whether the programme is solved, so far as was asked for.
        """
        every = self.needs(time)
        master = _Master(every, self.count)
        for group in self._known[-2000:]:
            master.add_known(group)
        usable = np.any([needs.weight > 0 for needs in every], axis=0)
        typical = np.maximum.reduce([np.minimum(needs.weight, needs.need.max()) for needs in every]).astype(float)
        price = np.where(usable, typical, 0.0) / max(1e-300, float(typical @ self.count))
        best: Prices | None = None
        smooth = 0.0
        while not should_stop():
            tables, found = [], self._whole(price)
            total = float(found @ self.count)
            worth = 0.0
            for needs in every:
                table = self._table(needs, found)
                tables.append(table)
                worth += float(table[0][needs.need].sum())
            if not np.isfinite(worth):
                return Prices(found, np.inf), True
            if best is None or worth / total > best.theta:
                # not merely close to 1: the sums of whole numbers decide
                theta = worth / total if worth != total else 1.0
                best = Prices(found, max(theta, np.nextafter(1.0, 2.0)) if worth > total else min(theta, 1.0))
            if best.theta > 1 or (master.solved and best.theta >= master.theta - CLOSE):
                return best, True
            new = master.add_groups(tables, self._known)
            if not new and smooth == 0.0 and master.solved:
                return best, True
            if not master.solve():
                return best, False
            if master.theta <= 1 + CLOSE and not converge:
                return best, True
            smooth = SMOOTH if new else 0.0
            price = smooth * best.price / max(1.0, float(best.price @ self.count)) + (1 - smooth) * master.price
        return best, False

    def costs(self, needs: Needs, price: FloatArray) -> FloatArray:
        """Return the cost of the cheapest group for each need up to the largest."""
        return self._table(needs, price)[0]

    def _whole(self, price: FloatArray) -> FloatArray:
        whole: FloatArray = np.round(np.maximum(0.0, price) * PRICES)
        return whole

    def _table(self, needs: Needs, price: FloatArray) -> Table:
        return fill_table(needs.weight, price, self.count, int(needs.need.max()), False)


class _Master:
    """The programme restricted to the groups known so far; tasks of the same need and weights are one row."""

    def __init__(self, every: list[Needs], count: WholeArray) -> None:
        self._rows: list[tuple[int, int, int]] = []  # set of needs, need, how many tasks
        for index, needs in enumerate(every):
            values, times = np.unique(needs.need, return_counts=True)
            self._rows += [(index, int(v), int(c)) for v, c in zip(values, times, strict=True)]
        self._every, self._count = every, count
        self._seen: set[tuple[int, bytes]] = set()
        self.solved, self.theta = False, np.inf
        self.price = self._mu = np.zeros(0)
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
        """Offer a group of earlier days to the task with the largest need that it covers."""
        done = [int(needs.weight @ group) for needs in self._every]
        covered = [(need, row) for row, (index, need, _) in enumerate(self._rows) if done[index] >= need]
        if covered:
            self._add(max(covered)[1], group)

    def add_groups(self, tables: list[Table], known: list[WholeArray]) -> bool:
        """Add the cheapest groups where they are cheaper than those in use; whether there was any."""
        new = False
        for row, (index, need, _) in enumerate(self._rows):
            group = read_group(tables[index], len(self._count), need)
            if self.solved and group @ self.price >= self._mu[row] - CLOSE / 10:
                continue
            if self._add(row, group):
                known.append(group)
                new = True
        return new

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

    def solve(self) -> bool:
        """Solve, if that works out."""
        self._highs.run()
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return False
        dual = np.asarray(self._highs.getSolution().row_dual)
        self._mu, self.price = dual[: len(self._rows)], np.maximum(0.0, -dual[len(self._rows) :])
        self.theta, self.solved = self._highs.getInfo().objective_function_value, True
        return True
