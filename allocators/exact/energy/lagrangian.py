"""A lower bound on the least energy by Lagrangian relaxation of (agents), strengthened by clusters of tasks.

With dual prices on the agents of the classes, the cheapest group of each task is a separate knapsack. The total cost of
these groups, less the value of all agents at these prices, is a lower bound on the cost of every plan. A *cluster* of
nearby tasks adds the constraint that it must also get an integer number of agents: its members pay dual prices for
their agents to the cluster, which solves a knapsack of its own. Prices follow a deflected subgradient.

A pair of class and task whose use would raise the bound above the cost of the incumbent plan is dropped, as no better
plan uses it. With fewer pairs, knapsacks and clusters shrink, and the bound rises.

References
----------
Geoffrion (1974), Lagrangean relaxation for integer programming, doi:10.1007/BFb0120690. Camerini, Fratta and Maffioli
(1975), On improving relaxation methods by modified gradient techniques, doi:10.1007/BFb0120697.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from alloc.allocators.exact.energy.clusters import Clusters, cluster_tasks, overlapping_clusters
from alloc.allocators.exact.energy.cuts.cutting_planes import CuttingPlanes, is_small
from alloc.allocators.exact.energy.energy_model import EnergyModel
from alloc.allocators.exact.energy.subproblems import solve_subproblems
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray


@dataclass(frozen=True)
class StepRule:
    """Parameters of the steps of the subgradient method.

    Attributes
    ----------
    deflection : float
        Share of the last direction that is added to the subgradient.
    patience : int
        Rounds without a better bound after which steps are shortened.
    decay : float
        Factor by which they are shortened.
    """

    deflection: float
    patience: int
    decay: float


BRIEF, CLUSTERED, LASTING = StepRule(0.75, 20, 0.7), StepRule(0.95, 60, 0.8), StepRule(0.99, 60, 0.8)
"""Rules before clusters are added, with clusters, and without any: more prices, and more time, need longer memory and
more patience."""

FIRST_STEP_PRICED = 0.1
"""First step from prices of the linear programme, which are already nearly optimal."""

COMPARE_EVERY = 10
"""Rounds between two searches for pairs to drop, if these take long."""

CONVERGED_STEP, CONVERGED_ALONE = 0.02, 0.005
"""Step lengths below which the bound hardly rises, with clusters (a solver is then better) and without; a step of 1 is
that aimed at the cost of the incumbent plan."""

MAX_LINKS, MAX_CUT_LINKS = 5_000_000, 20_000_000
"""Number of tasks times pairs of class and task above which there are no clusters, and limit on the number of clusters
times pairs for overlapping ones."""

DECAYS_ALONE, DECAYS_WITHOUT_CLUSTERS = 4, 1
"""Numbers of shortened steps after which clusters are added or, if there are none, cutting planes take over."""

LAST_GROUPS = 150
"""Number of last rounds whose groups initialise the cutting planes."""


@dataclass(frozen=True, eq=False)
class Relaxed:
    """The solution of the relaxation at some prices.

    Attributes
    ----------
    value : float
        The bound; ``inf`` if a task has no group.
    group : ndarray of int, shape (p,)
        Agents of each pair in the cheapest groups of tasks.
    excess : ndarray, shape (p,) or (0,)
        Lower bound on the extra cost of the best group with an agent of the pair.
    cluster_group : ndarray of int, shape (e,)
        Agents of each entry in the cheapest groups of clusters.
    """

    value: float
    group: WholeArray
    excess: FloatArray
    cluster_group: WholeArray


class LagrangianBound:
    """A subgradient ascent on dual prices; ``bound`` is proven at any time.

    Parameters
    ----------
    model : EnergyModel
    task_distance : ndarray, shape (t, t)
        Distances between tasks.
    price : ndarray, shape (k,)
        Initial price of an agent of each class.

    Attributes
    ----------
    bound : float
        Lower bound on the cost of all plans; ``inf`` if no plan is better than the incumbent.
    kept : ndarray of bool, shape (p,)
        Pairs that have not been dropped.
    """

    def __init__(self, model: EnergyModel, task_distance: FloatArray, price: FloatArray) -> None:
        self.kept = np.ones(len(model.class_of_pair), dtype=bool)
        self.bound, self._model = 0.0, model
        self._member = None
        links = len(model.need) * len(model.class_of_pair)
        self._cut_member = np.zeros((0, len(model.need)), dtype=bool)
        if model.ability is not None and len(model.need) > 3 and links <= MAX_LINKS:
            if self.may_be_cut:  # prices of clusters would converge more slowly than their cuts
                self._cut_member = overlapping_clusters(task_distance, MAX_CUT_LINKS // len(model.class_of_pair))
            else:
                self._member = cluster_tasks(task_distance)
        self._clusters: Clusters | None = None
        self._price, self._cluster_price = price, np.zeros(0)
        self._direction = (np.zeros(len(model.count)), np.zeros(0))
        self._known_price = np.zeros((0 if self._member is None else len(self._member), len(model.count)))
        self._dropped = np.zeros(len(model.class_of_pair), dtype=bool)
        self._step, self._rounds_without_rise, self._decays = FIRST_STEP_PRICED if price.any() else 1.0, 0, 0
        self._rounds = 0
        self._groups: deque[WholeArray] = deque(maxlen=LAST_GROUPS)

    @property
    def price(self) -> FloatArray:
        """Price of an agent of each class, shape (k,)."""
        return self._price

    @property
    def converged(self) -> bool:
        """Whether steps are so short that the bound hardly rises any more."""
        if self._member is None:
            return self._step < CONVERGED_ALONE
        return self._step < CONVERGED_STEP and self._clusters is not None

    @property
    def is_rising_slowly(self) -> bool:
        """Whether a solver may soon do better; hardly if sums of weights are limited, which clusters exploit."""
        return self._clusters is not None and bool(self._model.max_weight[0] < 0)

    @property
    def may_be_cut(self) -> bool:
        """Whether the model is small enough for cutting planes."""
        return is_small(self._model)

    @property
    def is_nearly_optimal(self) -> bool:
        """Whether prices are good enough for cutting planes to raise the bound faster."""
        return self._decays >= DECAYS_WITHOUT_CLUSTERS if self._member is None else self.converged

    def cutting_planes(self, plan: WholeArray, should_stop: Callable[[], bool]) -> CuttingPlanes:
        """Return the cutting-plane method initialised from here and from a plan, given by agents of each pair, (p,)."""
        groups = [plan[self.kept], *self._groups]
        return CuttingPlanes(self._model, self._cut_member, self._price, groups, should_stop)

    def ascend(self, rounds: int, cost: float) -> None:
        """Update prices `rounds` times, given the cost of the incumbent plan."""
        for _ in range(rounds):
            if self.bound >= cost * (1 - 1e-12):
                return
            self._round(cost)

    def _round(self, cost: float) -> None:
        relaxed = self._solve()
        self._rounds += 1
        if not np.isfinite(relaxed.value):  # the kept pairs allow no plan, so the incumbent is optimal
            self.bound, self._step = (self.bound if self.kept.all() else np.inf), 0.0
            return
        if len(relaxed.excess):
            self._dropped |= relaxed.value + relaxed.excess > cost * (1 + 1e-9)
        self._note(relaxed.value)
        if self.may_be_cut:
            self._groups.append(relaxed.group)
        self._change_prices(relaxed, cost)
        add = self._clusters is None and self._decays >= DECAYS_ALONE and self._member is not None
        if add:
            self._step = 0.5
        if add or self._dropped.sum() > 0.1 * len(self._dropped):
            self._shrink(clusters=add or self._clusters is not None)

    def _solve(self) -> Relaxed:
        """Solve the relaxation at the current prices."""
        model, clusters, cluster_group = self._model, self._clusters, np.zeros(0, dtype=np.int64)
        price = model.cost + self._price[model.class_of_pair]
        value = -float(np.where(self._price >= 0, model.count, model.min_agents) @ self._price)
        if clusters is not None:
            price += clusters.link @ self._cluster_price
            cluster_group, _, cluster_cost = solve_subproblems(clusters.model, -self._cluster_price, compare=False)
            value += cluster_cost
        # for integer weights without a limit, the excess takes much longer than the groups
        compare = self._rounds % COMPARE_EVERY == 0 or bool(model.max_weight[0] >= 0) or not model.is_whole
        group, excess, task_cost = solve_subproblems(model, price, compare=compare)
        return Relaxed(value + task_cost, group, excess, cluster_group)

    def _change_prices(self, relaxed: Relaxed, cost: float) -> None:
        """Step along the subgradient, deflected by the last direction (Camerini, Fratta and Maffioli)."""
        model, clusters, deflection = self._model, self._clusters, self._step_rule.deflection
        used = np.bincount(model.class_of_pair, relaxed.group, len(model.count)).astype(np.int64)
        slope = _subgradient(used, model, self._price)
        cluster_slope = np.zeros(0) if clusters is None else clusters.link.T @ relaxed.group - relaxed.cluster_group
        if not (slope.any() or cluster_slope.any()):  # the maximum; along the old direction prices would diverge
            self._step = 0.0
            return
        direction = slope + deflection * self._direction[0]
        cluster_direction = cluster_slope + deflection * self._direction[1]
        self._direction = (direction, cluster_direction)
        norm = float(direction @ direction + cluster_direction @ cluster_direction)
        if norm > 0:
            step = self._step * max(cost - relaxed.value, 1e-6 * cost) / norm
            self._price, self._cluster_price = (
                self._price + step * direction,
                self._cluster_price + step * cluster_direction,
            )
            self._price = np.where(model.min_agents < model.count, np.maximum(self._price, 0.0), self._price)

    @property
    def _step_rule(self) -> StepRule:
        if self._member is None:
            return LASTING
        return BRIEF if self._clusters is None else CLUSTERED

    def _note(self, value: float) -> None:
        """Record a bound; shorten steps if the best one has not risen for long."""
        self._rounds_without_rise += 1
        if value > self.bound * (1 + 1e-7):
            self._rounds_without_rise = 0
        self.bound = max(self.bound, value)
        if self._rounds_without_rise >= self._step_rule.patience:
            self._step, self._rounds_without_rise = self._step * self._step_rule.decay, 0
            self._decays += 1

    def _shrink(self, *, clusters: bool) -> None:
        """Drop the pairs that no better plan uses, and rebuild the clusters with their last prices."""
        stay = ~self._dropped
        self._groups.clear()
        self.kept[self.kept] = stay
        self._model = self._model.only(stay)
        self._dropped = np.zeros(len(self._model.class_of_pair), dtype=bool)
        if self._clusters is not None:
            entries = self._clusters.model
            self._known_price[entries.task_of_pair, entries.class_of_pair] = self._cluster_price
        if clusters and self._member is not None:
            self._clusters = Clusters.build(self._model, self._member)
            entries = self._clusters.model
            self._cluster_price = self._known_price[entries.task_of_pair, entries.class_of_pair]
            self._direction = (self._direction[0], np.zeros(len(entries.class_of_pair)))


def _subgradient(used: WholeArray, model: EnergyModel, price: FloatArray) -> FloatArray:
    """Return used agents of each class minus the limit that its price is for, shape (k,); at price 0, the violation."""
    above, below = used - model.count, used - model.min_agents
    unpriced: FloatArray = np.maximum(above, 0.0) + np.minimum(below, 0.0)
    return np.where(price > 0, above, np.where(price < 0, below, unpriced))
