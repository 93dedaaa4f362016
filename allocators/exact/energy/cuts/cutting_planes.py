"""A lower bound on the least energy by column generation and cutting planes, starting from Lagrangian prices.

The Lagrangian relaxation is equivalent to a linear programme over mixtures (convex combinations) of groups for each
task. From nearly optimal prices, column generation solves it in few rounds and yields the mixtures, of which cuts
exclude some. At any prices and penalties, the cost of the cheapest groups less the value of agents and cuts is a lower
bound on the cost of every plan.

References
----------
Desaulniers, Desrosiers and Solomon, eds. (2005), Column Generation, doi:10.1007/b135457. Wentges (1997), Weighted
Dantzig-Wolfe decomposition for linear mixed-integer programming, doi:10.1016/S0969-6016(97)00001-4.
"""

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array

from alloc.allocators.exact.energy.cuts.all_groups import groups_within
from alloc.allocators.exact.energy.cuts.group_master import GroupMaster
from alloc.allocators.exact.energy.cuts.group_programme import GroupProgramme
from alloc.allocators.exact.energy.cuts.known_prices import KnownPrices
from alloc.allocators.exact.energy.cuts.pricing import STEPS, price_groups
from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.energy.subproblems import solve_subproblems
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray

SMOOTHING = 0.7
"""Weight of the best prices so far in the next trial prices (stabilisation)."""

PRECISION, EARLY = 1e-5, 0.05
"""Relative difference between bound and programme at which prices count as optimal; share of the gap to the plan at
which cuts are added before that."""

FIRST_NODES, MORE_NODES, MAX_NODES = 20_000, 4, 4_000_000
"""Limit on the nodes of the search for one group at first, its growth factor, and the limit on all searches of a round,
less than a second."""

MAX_LOSS = 0.1
"""Share of the gap to the plan that truncated searches for groups may cost. Beyond it, longer searches are allowed; if
even the longest ones lose as much, cuts over classes, which slow them down, are removed."""

MORE = 8
"""Factor on the number of enumerated groups, as earlier prices exclude many of them."""

MAX_KEPT = 0.95
"""Pairs are dropped only if at most this share of them is kept."""

MAX_PAIRS, MAX_CLASSES, MAX_CELLS, MAX_USES = 30_000, 1000, 20_000_000, 200_000
"""Numbers of pairs of class and task, classes, table cells of a round, and tasks times classes, above which the method
takes too long or too much memory."""


def is_small(model: EnergyModel) -> bool:
    """Whether the model is small enough for many rounds."""
    classes, tasks = len(model.count), len(model.need)
    if len(model.copies) > MAX_PAIRS or classes > MAX_CLASSES or classes * tasks > MAX_USES:
        return False
    steps = np.maximum(model.need, model.max_weight) if model.is_whole else np.full(tasks, STEPS)
    return float(model.copies @ steps[model.task_of_pair]) <= MAX_CELLS


class CuttingPlanes:
    """An ascent by column generation and cuts; ``bound`` is proven at any time.

    Parameters
    ----------
    model : EnergyModel
    member : ndarray of bool, shape (f, t)
        Clusters of tasks.
    price : ndarray, shape (k,)
        Initial prices.
    groups : list of ndarray of int, shape (p,)
        Initial groups of all tasks, by pairs, including those of a plan.
    should_stop : callable
        Called while cuts are separated, groups enumerated and programmes solved.

    Attributes
    ----------
    bound : float
        Lower bound on the cost of all plans.
    kept : ndarray of bool, shape (p,)
        Pairs that have not been dropped; no better plan uses a dropped one.
    least_with : ndarray, shape (p,)
        Lower bound on plans with an agent of each kept pair, as of the last check of pairs.
    converged : bool
        Whether the mixture violates no cut, or the programme could not be solved.
    """

    def __init__(
        self,
        model: EnergyModel,
        member: Mask,
        price: FloatArray,
        groups: list[WholeArray],
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._model, self._should_stop = model, should_stop
        self._weight, self._need = model.weight.astype(np.float64), model.need.astype(np.float64)
        self._master, self._smoothing = GroupMaster(model, member), SMOOTHING
        for group in groups:
            self._master.add(group)
        self._nodes = FIRST_NODES
        self._price, self._penalty, self._known_prices = price, np.zeros(0), KnownPrices()
        self.bound, self.converged, self._found_none = -np.inf, False, False
        self.kept, self.least_with = np.ones(len(model.copies), dtype=bool), np.full(len(model.copies), -np.inf)

    @property
    def price(self) -> FloatArray:
        """The best prices of agents so far, shape (k,)."""
        return self._price

    @property
    def mixture(self) -> FloatArray:
        """Agents of each kept pair in the cheapest mixture of the groups so far, shape (p,)."""
        return self._master.mixture

    def ascend(self, rounds: int, cost: float) -> None:
        """Run `rounds` rounds of pricing, given the cost of the incumbent plan."""
        for _ in range(rounds):
            if self.converged or self.bound >= cost * (1 - 1e-12):
                return
            self._round(cost)

    def note_plan(self, plan: WholeArray) -> None:
        """Record a better plan, given by its agents of each initial pair."""
        if not plan[~self.kept].any() and self._master.add(plan[self.kept]):
            self.converged = False

    def all_groups(self, cost: float, most: int) -> GroupProgramme | None:
        """Return all groups of plans that cost less than `cost`; None if more than `most`, or if stopped.

        In such plans, the extra cost of a group over the cheapest one of its task is at most `cost` minus the bound.
        """
        model, master, penalty = self._model, self._master, self._known_penalty
        value, _, least = self._relax(self._price, penalty)
        limit, cuts = least + cost * (1 + 1e-9) - value, (*master.cuts_of_pairs(penalty), penalty)
        found = groups_within(model, self._paid(self._price, penalty), limit, cuts, MORE * most, self._should_stop)
        if found is None:
            return None
        (task, groups), on = found, penalty > 0
        used = master.used(task, model.by_class(groups).toarray())
        can = self._known_prices.within(model, cost, task, groups, used, master.sets)
        if can.sum() > most:
            return None
        return GroupProgramme(model, cost, task[can], groups[can], csr_array(used[can][:, on]), master.limit[on])

    @property
    def _known_penalty(self) -> FloatArray:
        """The best penalties so far, zero for newer cuts, shape (c,)."""
        return np.append(self._penalty, np.zeros(len(self._master.limit) - len(self._penalty)))

    def _round(self, cost: float) -> None:
        master = self._master
        if not master.solve(self._should_stop):
            self.converged = True
            return
        known = self._known_penalty
        smoothing = self._smoothing if np.isfinite(self.bound) else 1.0
        price = smoothing * self._price + (1 - smoothing) * master.price
        penalty = smoothing * known + (1 - smoothing) * master.penalty
        value, group, least = self._relax(price, penalty)
        if self._lost(group, least, price, penalty) > MAX_LOSS * max(0.0, cost - max(self.bound, value)):
            if MORE_NODES * self._nodes * len(self._need) <= MAX_NODES:
                self._nodes *= MORE_NODES
                return
            known[master.leave_out_sets()] = 0.0
            self._penalty = known
            return
        if value > self.bound:
            self.bound, self._price, self._penalty = value, price, penalty
        is_new = master.add(group)
        is_best = self.bound >= master.value * (1 - PRECISION) or not (is_new or self._smoothing)
        is_near = master.value - self.bound <= EARLY * (cost - self.bound) and not self._found_none
        if is_best or is_near:
            found = self._drop_pairs(cost) or master.separate(self._should_stop)
            self.converged, self._found_none = is_best and not found, not (is_best or found)
            is_new = True
        self._smoothing = SMOOTHING if is_new else (self._smoothing / 2 if self._smoothing > 0.2 else 0.0)

    def _lost(self, group: WholeArray, least: FloatArray, price: FloatArray, penalty: FloatArray) -> float:
        """Return the loss in the bound by truncated searches for groups, which cuts over classes make long."""
        master = self._master
        if not (master.seeks_sets and penalty.any()):
            return 0.0
        nothing = np.bincount(self._model.task_of_pair, group, len(least)) == 0
        return float((master.cheapest(price, penalty) - least)[nothing].sum())

    def _drop_pairs(self, cost: float) -> bool:
        """Drop the pairs that no cheaper plan uses, if they are many; return whether any were dropped.

        With an agent of a pair, the cost of its task is at least that of its best group with the agent, without
        penalties of cuts over classes; the costs of other tasks are those in the bound.
        """
        model = self._model
        penalty = self._known_penalty
        value, _, least = self._relax(self._price, penalty)
        paid = self._paid(self._price, penalty)
        self._known_prices.note(model, paid, penalty, value, least)
        self._master.leave_out_dear(self._price, penalty, least, cost * (1 + 1e-9) - value)
        group, excess, total = solve_subproblems(model, paid)
        unpenalised = np.bincount(model.task_of_pair, group * paid, len(least))
        if not np.isfinite(total) or abs(total - unpenalised.sum()) > 1e-9 * np.abs(unpenalised).sum():
            return False  # a search for a group was truncated
        more = excess + (unpenalised - least)[model.task_of_pair]
        self.least_with, stay = value + more, value + more <= cost * (1 + 1e-9)
        if stay.mean() > MAX_KEPT:
            return False
        self.least_with = self.least_with[stay]
        self.kept[self.kept] = stay
        self._model = model.only(stay)
        self._weight = self._weight[stay]
        self._master.restrict(self._model)
        return True

    def _paid(self, price: FloatArray, penalty: FloatArray) -> FloatArray:
        """Return the cost of an agent of each pair including its price and the cuts of clusters, shape (p,)."""
        return np.asarray(self._model.cost + price[self._model.class_of_pair] + self._master.fees(penalty))

    def _relax(self, price: FloatArray, penalty: FloatArray) -> tuple[float, WholeArray, FloatArray]:
        """Return the Lagrangian bound at some prices, groups that are cheaper than known ones, and the least costs."""
        model, master = self._model, self._master
        whole, paid = model.is_whole, self._paid(price, penalty)
        if penalty.any() or whole:
            group = np.zeros(len(paid), dtype=np.int64)
            first_cut, cut = master.cuts_of_pairs(penalty)
            least = master.cheapest(price, penalty)
            value = price_groups(
                model.first, self._weight, paid, model.copies, self._need, model.max_weight, whole,
                first_cut, cut, penalty, least, group, self._nodes,
            )  # fmt: skip
        else:
            group, _, value = solve_subproblems(model, paid, compare=False)
            least = np.asarray(np.bincount(model.task_of_pair, group * paid, len(model.need)), dtype=np.float64)
        value -= float(np.where(price >= 0, model.count, model.min_agents) @ price + master.limit @ penalty)
        return value, group, least
