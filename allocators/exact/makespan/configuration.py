"""The configuration linear programme, a relaxation in which each task takes a convex combination of groups of agents.

At a fixed T, a *group* suits a task if its agents complete the task by then. The programme chooses convex combinations
of groups such that the largest relative use of a class of agents is least:

    minimise theta:  sum_p x_jp = 1 for each task j,   sum_jp agents_pk x_jp <= theta count_k for each class k.

If theta > 1, there is no plan. Groups are generated as needed by a knapsack at the dual prices of the classes (column
generation). For any prices >= 0, theta is at least the total cost of the cheapest groups of all tasks divided by the
total cost of all agents: this comparison, in integers, is the proof, for which the programme only provides prices.

References
----------
Azar and Epstein (1998), On-line machine covering, doi:10.1002/(SICI)1099-1425(199808)1:2<67::AID-JOS6>3.0.CO;2-Y.
Gilmore and Gomory (1961), A linear programming approach to the cutting-stock problem, doi:10.1287/opre.9.6.849.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from alloc.allocators.exact.knapsack import Table, WholeArray, fill_table
from alloc.allocators.exact.makespan.restricted_master import CLOSE, RestrictedMaster, TaskNeeds
from alloc.allocators.exact.model import Model
from alloc.problems.instance import FloatArray, IntArray

MAX_NEED = 20_000
"""Largest integer need up to which needs are not rounded."""

GRID, FINE_GRID = 2**13, 2**17
"""Number of steps of the largest need otherwise, at first and at the end: weights are rounded up, needs down."""

MAX_CELLS = 30_000_000
"""Number of agents times steps times tables above which no prices are computed."""

PRICE_SUM = 2.0**40
"""Approximate total cost of all agents; prices are integers, so that their sums are exact."""

SMOOTHING = 0.6
"""Weight of the best prices so far in the next trial prices (stabilisation)."""

WHOLE, ROUNDED = 1e-8, 0.1
"""Relative precision of T for integer needs, and otherwise as a share of a step."""

MAX_REUSED = 2000
"""Number of the latest groups that are reused at the next T."""


@dataclass(frozen=True, eq=False)
class DualPrices:
    """Prices of the classes, and the bound that they prove.

    Attributes
    ----------
    price : ndarray, shape (k,)
        Integers >= 0.
    theta : float
        Cost of the cheapest groups of all tasks divided by that of all agents; above 1 it proves T infeasible. ``inf``
        if all agents together cannot do some task.
    converged : bool
        Whether the programme is solved to the requested extent.
    """

    price: FloatArray
    theta: float
    converged: bool = False


class ConfigurationProgramme:
    """Proves T infeasible by dual prices; reuses the groups found at one T at the next.

    Parameters
    ----------
    model : Model
        All of its tasks must be served.
    low : float
        Hours; lower bound on all T that will be asked for.
    grid : int
        Number of steps of the largest need if needs are not integers.

    Attributes
    ----------
    count : ndarray of int64, shape (k,)
        Agents in each class.
    is_tractable : bool
        Whether its tables are small enough.
    precision : float
        Relative precision of T.
    """

    def __init__(self, model: Model, low: float, grid: int = GRID) -> None:
        self._model, self._grid = model, grid
        _, need = model.uncapped(low)
        mask = model.classes.mask[:, model.tasks]
        if model.travel_time is None:
            _, group = np.unique(mask, axis=1, return_inverse=True)
            group = group.reshape(-1)
        else:
            group = np.arange(len(model.tasks))
        self._tasks_alike = [np.flatnonzero(group == g) for g in range(group.max() + 1)]
        self.count = model.classes.count.astype(np.int64)
        largest = np.array([need[tasks].max() for tasks in self._tasks_alike])
        is_whole = model.unit is not None and need.max() <= MAX_NEED
        self._steps = np.ones(len(largest)) if is_whole else largest / grid
        self.precision = WHOLE if is_whole else ROUNDED / grid
        agents = np.minimum(self.count, grid) @ (mask[:, [tasks[0] for tasks in self._tasks_alike]])
        self.is_tractable = bool(agents @ (largest / self._steps) <= MAX_CELLS)
        self._known: list[WholeArray] = []

    def refined(self, low: float) -> "ConfigurationProgramme | None":
        """Return the programme with the finest tractable steps; None if they are not finer than the present ones."""
        if self.precision == WHOLE or self._grid == FINE_GRID:
            return None
        grid = FINE_GRID
        while grid > self._grid:
            finer = ConfigurationProgramme(self._model, low, grid)
            if finer.is_tractable:
                finer._known = self._known
                return finer
            grid //= 2
        return None

    def needs(self, time: float) -> list[TaskNeeds]:
        """Return the needs at T = `time`, rounded such that their infeasibility implies that of T."""
        weight, need = self._model.uncapped(time)
        return [
            _in_steps(tasks, weight[:, tasks[0]], need[tasks], step)
            for tasks, step in zip(self._tasks_alike, self._steps.tolist(), strict=True)
        ]

    def largest_infeasible(self, prices: DualPrices, low: float, high: float) -> float:
        """Return (nearly) the largest T from `low` to `high` that these prices prove infeasible, or `low`."""
        if self._model.travel_time is not None:
            return low
        total = float(prices.price @ self.count)
        costs = [self.group_costs(needs, prices.price) for needs in self.needs(low)]

        def impossible(time: float) -> bool:
            found = self.needs(time)
            return bool(sum(cost[needs.need].sum() for cost, needs in zip(costs, found, strict=True)) > total)

        proven = low
        while high - low > 1e-10 * high:
            middle = (low + high) / 2
            if impossible(middle):
                low = proven = middle
            else:
                high = middle
        return proven

    def dual_prices(self, time: float, should_stop: Callable[[], bool], *, converge: bool = False) -> DualPrices | None:
        """Solve the programme at T = `time` by column generation, until it is clear whether T is infeasible.

        Parameters
        ----------
        converge : bool
            Whether to solve to optimality if it is not.

        Returns
        -------
        DualPrices or None
            The best ones found; None if stopped before there were any.
        """
        tasks = self.needs(time)
        master = RestrictedMaster(tasks, self.count)
        for group in self._known[-MAX_REUSED:]:
            master.add_known(group)
        price, smoothing = self._first_price(tasks), 0.0
        best: DualPrices | None = None
        while not should_stop():
            priced, tables = self.solve_pricing(tasks, price)
            if best is None or priced.theta > best.theta:
                best = priced
            if best.theta > 1 or (master.solved and best.theta >= master.theta - CLOSE):
                return replace(best, converged=True)
            new = master.add_groups(tables, priced.price, self._known)
            if not new and smoothing == 0.0 and master.solved:
                return replace(best, converged=True)
            if not master.solve():
                return best
            if master.theta <= 1 + CLOSE and not converge:
                return replace(best, converged=True)
            smoothing = SMOOTHING if new else 0.0
            total = max(1.0, float(best.price @ self.count))
            price = smoothing * best.price / total + (1 - smoothing) * master.price
        return best

    def group_costs(self, needs: TaskNeeds, price: FloatArray) -> FloatArray:
        """Return the cost of the cheapest group for each need up to the largest."""
        return self._table(needs, price)[0]

    def _first_price(self, tasks: list[TaskNeeds]) -> FloatArray:
        """Return prices proportional to the largest weight of each class, with total cost 1 of all agents."""
        usable = np.any([needs.weight > 0 for needs in tasks], axis=0)
        typical = np.maximum.reduce([np.minimum(needs.weight, needs.need.max()) for needs in tasks]).astype(float)
        return np.where(usable, typical, 0.0) / max(1e-300, float(typical @ self.count))

    def solve_pricing(self, tasks: list[TaskNeeds], price: FloatArray) -> tuple[DualPrices, list[Table]]:
        """Find the cheapest groups at `price`, rounded to integers; return the bound they prove, and their tables."""
        whole: FloatArray = np.round(np.maximum(0.0, price) * PRICE_SUM)
        total, cost = float(whole @ self.count), 0.0
        tables = [self._table(needs, whole) for needs in tasks]
        for needs, table in zip(tasks, tables, strict=True):
            cost += float(table[0][needs.need].sum())
        if not np.isfinite(cost):
            return DualPrices(whole, np.inf), tables
        theta = cost / total if cost != total else 1.0  # exact: the integer sums decide, not their rounded ratio
        return DualPrices(whole, max(theta, np.nextafter(1.0, 2.0)) if cost > total else min(theta, 1.0)), tables

    def _table(self, needs: TaskNeeds, price: FloatArray) -> Table:
        return fill_table(needs.weight, price, self.count, int(needs.need.max()), False)


def _in_steps(tasks: IntArray, weight: FloatArray, need: FloatArray, step: float) -> TaskNeeds:
    """Round weights and needs to steps, unless they are integers; return them as arrays for compiled loops."""
    if step == 1.0:
        return TaskNeeds(tasks, np.ascontiguousarray(weight.astype(np.int64)), need.astype(np.int64))
    whole_need = np.maximum(1, np.floor(need / step * (1 - 1e-12))).astype(np.int64)
    return TaskNeeds(tasks, np.ascontiguousarray(np.ceil(weight / step).astype(np.int64)), whole_need)
