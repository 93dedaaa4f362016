"""A lower bound on the least energy by mixtures of groups with cuts: column generation from Lagrangian prices.

The mixtures of groups for each task, of which the Lagrangian relaxation gives the least cost in the end, are a linear
programme. Column generation solves it in few rounds from prices that are nearly the best, and then shows which
mixtures there are: cuts over sets of classes rule some out. At any prices and penalties the cheapest groups, less what
the agents and cuts cost, bound the cost of every plan from below. Prices that clusters pay stay as they are.

References
----------
Desaulniers, Desrosiers and Solomon, eds. (2005), Column Generation, doi:10.1007/b135457. Wentges (1997), Weighted
Dantzig-Wolfe decomposition for linear mixed-integer programming, doi:10.1016/S0969-6016(97)00001-4.
"""

import numpy as np

from alloc.allocators.exact.energy.cuts.group_master import GroupMaster
from alloc.allocators.exact.energy.cuts.pricing import STEPS, price_groups
from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.energy.subproblems import solve_subproblems
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray

SMOOTHING = 0.7
"""Part of the best prices so far in those that are tried next."""

PRECISION = 1e-5
"""Relative difference between bound and programme at which cuts are added."""

MAX_PAIRS, MAX_CLASSES, MAX_CELLS, MAX_USES = 30_000, 1000, 20_000_000, 200_000
"""Pairs of class and task, classes, cells of all tables of a round, and tasks times classes, above which all this takes
too long or too much memory."""


def is_small(model: EnergyModel) -> bool:
    """Whether rounds are so short that there may be many."""
    classes, tasks = len(model.count), len(model.need)
    if len(model.copies) > MAX_PAIRS or classes > MAX_CLASSES or classes * tasks > MAX_USES:
        return False
    steps = np.maximum(model.need, model.max_weight) if model.is_whole else np.full(tasks, STEPS)
    return float(model.copies @ steps[model.task_of_pair]) <= MAX_CELLS


class CuttingPlanes:
    """An ascent by column generation and cuts; ``bound`` is proven all the while.

    Parameters
    ----------
    model : EnergyModel
    member : ndarray of bool, shape (f, t)
        Clusters of tasks.
    price : ndarray, shape (k,)
        To begin with.
    groups : list of ndarray of int, shape (p,)
        Groups of all tasks to begin with, by pairs, those of a plan among them.

    Attributes
    ----------
    bound : float
        No plan costs less.
    converged : bool
        Whether the mixture violates no cut, or the programme could not be solved.
    """

    def __init__(self, model: EnergyModel, member: Mask, price: FloatArray, groups: list[WholeArray]) -> None:
        self._model = model
        self._weight, self._need = model.weight.astype(np.float64), model.need.astype(np.float64)
        self._master, self._smoothing = GroupMaster(model, member), SMOOTHING
        for group in groups:
            self._master.add(group)
        self._price, self._penalty = price, np.zeros(0)
        self.bound, self.converged = -np.inf, False

    def ascend(self, rounds: int) -> None:
        """Do so many rounds of pricing."""
        for _ in range(rounds):
            if not self.converged:
                self._round()

    def _round(self) -> None:
        master = self._master
        if not master.solve():
            self.converged = True
            return
        known = np.append(self._penalty, np.zeros(len(master.penalty) - len(self._penalty)))
        smoothing = self._smoothing if np.isfinite(self.bound) else 1.0
        price = smoothing * self._price + (1 - smoothing) * master.price
        penalty = smoothing * known + (1 - smoothing) * master.penalty
        value, group = self._relax(price, penalty)
        if value > self.bound:
            self.bound, self._price, self._penalty = value, price, penalty
        is_new = master.add(group)
        if self.bound >= master.value * (1 - PRECISION) or not (is_new or self._smoothing):
            self.converged = not master.separate()
            is_new = True
        self._smoothing = SMOOTHING if is_new else (self._smoothing / 2 if self._smoothing > 0.2 else 0.0)

    def _relax(self, price: FloatArray, penalty: FloatArray) -> tuple[float, WholeArray]:
        """Return the Lagrangian bound at some prices, and groups that are cheaper there than those known."""
        model, master = self._model, self._master
        whole, paid = model.is_whole, model.cost + price[model.class_of_pair] + master.fees(penalty)
        if penalty.any() or whole:
            group = np.zeros(len(paid), dtype=np.int64)
            first_cut, cut = master.cuts_of_pairs(penalty)
            value = price_groups(
                model.first, self._weight, paid, model.copies, self._need, model.max_weight, whole,
                first_cut, cut, penalty, master.cheapest(price, penalty), group,
            )  # fmt: skip
        else:
            group, _, value = solve_subproblems(model, paid, compare=False)
        value -= float(np.where(price >= 0, model.count, model.min_agents) @ price + master.limit @ penalty)
        return value, group
