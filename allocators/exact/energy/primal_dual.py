"""Plans by pairwise repartition and bounds by Lagrangian relaxation, to close the gap on the energy from both sides."""

from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.energy.clusters import pairwise_distance
from alloc.allocators.exact.energy.cuts.cutting_planes import CuttingPlanes
from alloc.allocators.exact.energy.cuts.group_programme import GroupProgramme
from alloc.allocators.exact.energy.energy_model import EnergyModel, round_demand
from alloc.allocators.exact.energy.lagrangian import LagrangianBound
from alloc.allocators.exact.energy.linear import class_prices
from alloc.allocators.exact.energy.pairwise_search import MAX_WORK, PairwiseSearch, begin_primal
from alloc.allocators.exact.energy.timer import Timer
from alloc.allocators.exact.model import ROUNDING, Model
from alloc.allocators.parallel.pool import Pool
from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

STATES = 2000
"""Number of table cells assumed for a pair if weights are not integers."""

MAX_TASKS = 2000
"""Number of tasks above which neither side is used, because of memory."""

MAX_LEAD_S = 0.1
"""Lead in time of one side at which it waits for the other."""

LONG, SHORT_S, STUCK = 1.5, 0.5, 2.0
"""The search for plans is stuck if its time exceeds the first value times that until its best plan, and the second
value in seconds; it then gets the time of bounds divided by the third."""

MAX_CUT_ROUNDS = 5
"""Largest number of rounds of cutting planes in one call, as one may take as long as many rounds of subgradients."""

FEW_GROUPS = 2500
"""Total number of groups up to which an integer programme selects among them while bounds still rise."""

PARTS = 1.0, 0.7, 0.5, 0.35, 0.25
"""Shares of the gap that are tried in turn until the number of groups within is small enough."""

LESS_GAP = 0.9
"""Groups are counted again once the gap is this share of the last one."""

REPEATABLE_SLICES, REPEATABLE_ROUNDS = 60, 10
"""Number of slices, and of rounds per slice, in repeatable runs."""


def compile_loops() -> None:
    """Compile all loops, or load them from the cache, so that they do not delay a run."""
    plan = np.array([0, 1])
    plans = PairwiseSearch(plan, np.ones(2, dtype=int), np.ones((2, 2)), np.ones(2, dtype=int), np.zeros((2, 2)), 0)
    plans.descend()
    plans.anneal(1, 0.0)
    one, two = np.ones(2, dtype=np.int64), np.array([0, 1])
    for weight in (one, np.ones(2)):
        model = EnergyModel(two, two, weight, one, np.ones(2), weight, one, one, one, None)
        LagrangianBound(model, np.zeros((2, 2)), np.zeros(2)).ascend(1, 3.0)
        cuts = CuttingPlanes(model, np.zeros((0, 2), dtype=bool), np.zeros(2), [one])
        cuts.ascend(1, 3.0)
        cuts.all_groups(3.0, 10)


class PrimalDual:
    """Plans and lower bounds for the least energy within `demand`, with all tasks served that `plan` serves.

    Parameters
    ----------
    instance : Instance
    model : Model
    demand : Demand
    plan : Allocation
        A plan that meets the demand.
    seed : int
    seconds : float
        Time limit of the initial linear programme.
    should_stop : callable
        Called during the separation of cuts and the enumeration of groups.
    """

    def __init__(
        self,
        instance: Instance,
        model: Model,
        demand: Demand,
        plan: Allocation,
        seed: int,
        seconds: float,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._model, self._demand, self._plan = model, demand, plan
        task_distance = pairwise_distance(instance.reach.goal[model.tasks])
        self._pairs: IntArray = np.arange(len(demand.class_of_pair))
        self._dual = None if demand.partial else self._begin_dual(task_distance, seconds)
        self._cuts: CuttingPlanes | None = None
        self._should_stop = should_stop
        self._primal = begin_primal(instance, model, demand, plan, task_distance, seed)
        self._reported = self._cost = _cost_of_plan(instance, plan)
        self._gap_tried, self._least_with = np.inf, np.zeros(0)
        self._primal_timer, self._dual_timer, self._improved_s = Timer(), Timer(), 0.0
        self._descended = self._primal is None

    @property
    def bound(self) -> float:
        """Proven lower bound on the cost of all plans."""
        return min(self._proven * (1 - ROUNDING), self._cost)

    @property
    def _proven(self) -> float:
        """The bound, which may exceed the cost of the best plan by rounding errors."""
        bound = 0.0 if self._dual is None else self._dual.bound
        return bound if self._cuts is None else max(bound, self._cuts.bound)

    @property
    def price(self) -> FloatArray | None:
        """Price of an agent of each class, shape (k,), once prices are nearly optimal; None before."""
        dual = self._dual if self._dual is not None and self._dual.is_nearly_optimal else None
        return self._cuts.price if self._cuts is not None else None if dual is None else dual.price

    @property
    def finds_plans(self) -> bool:
        """Whether there is a primal side."""
        return self._primal is not None

    @property
    def is_empty(self) -> bool:
        """Whether there is neither a primal nor a dual side."""
        return self._primal is None and self._dual is None

    @property
    def closed(self) -> bool:
        """Whether the best plan is proven optimal."""
        return self._dual is not None and self._proven >= self._cost * (1 - 1e-9)

    @property
    def converged(self) -> bool:
        """Whether bounds hardly rise any more."""
        if self._cuts is not None:
            return self._cuts.converged
        return self._dual is None or (self._dual.converged and not self._dual.may_be_cut)

    @property
    def is_rising_slowly(self) -> bool:
        """Whether bounds have risen for long enough that the solver may raise them faster."""
        if self._cuts is not None:
            return self._cuts.converged
        return self._dual is None or (self._dual.is_rising_slowly and not self._dual.may_be_cut)

    def few_groups(self) -> GroupProgramme | None:
        """Return all groups of better plans if they are few; otherwise None, until the gap is less."""
        if self._cuts is None:
            return None
        gap = self._cost - self._cuts.bound
        if gap > LESS_GAP * self._gap_tried:
            return None
        self._gap_tried = gap
        return self._cuts.all_groups(self._cost, FEW_GROUPS)

    @property
    def mixture(self) -> FloatArray | None:
        """Agents of each pair of the demand in the cheapest mixture of groups so far; None before there is one."""
        if self._cuts is None:
            return None
        mixed = np.zeros(len(self._demand.class_of_pair))
        mixed[self._kept] = self._cuts.mixture
        return mixed

    def groups_of_cheapest(self, most: int) -> GroupProgramme | None:
        """Return all groups of plans that cost less than the bound plus a share of the gap.

        The share is the largest one with at most `most` groups; None if even the smallest share has more.
        """
        if self._cuts is None:
            return None
        bound = self._cuts.bound
        tried = (self._cuts.all_groups(bound + part * (self._cost - bound), most) for part in PARTS)
        return next((groups for groups in tried if groups is not None), None)

    def allocation(self, programme: GroupProgramme, counts: IntArray) -> Allocation:
        """Return the allocation with these numbers of agents of the programme's pairs."""
        full = np.zeros(len(self._demand.class_of_pair), dtype=np.intp)
        full[self._kept] = counts
        return self._model.allocation(self._demand, full)

    @property
    def keep(self) -> IntArray:
        """Pairs of the demand that a better plan may use, sorted."""
        return np.sort(self._kept)

    @property
    def _kept(self) -> IntArray:
        """Pairs of the demand that the dual side has kept, in the order of its model."""
        kept = self._pairs if self._dual is None else self._pairs[self._dual.kept]
        return kept if self._cuts is None else kept[self._cuts.kept]

    def run(self, progress: float, pool: Pool | None) -> Allocation | None:
        """Run both sides for some 10 ms each; return a plan if a better one was found.

        Parameters
        ----------
        progress : float
            Share of the time that has passed, from 0 to 1.
        pool : Pool or None
            Runs one side while the calling thread runs the other.
        """
        if not self._descended:
            return self._descend()
        rising = None if pool is None else pool.submit(self._ascend)
        lead_s = self._lead_s  # a round of either side may take long
        if self._primal is not None and (lead_s <= MAX_LEAD_S or rising is not None):
            primal = self._primal
            self._primal_timer.run(lambda rounds: primal.anneal(rounds, progress))
        if rising is not None:
            rising.result()
        elif lead_s >= -MAX_LEAD_S or self._primal is None:
            self._ascend()
        return self._better()

    @property
    def _lead_s(self) -> float:
        """Seconds by which the search for plans is ahead of its share."""
        spent_s = self._primal_timer.spent_s
        is_stuck = spent_s > LONG * self._improved_s + SHORT_S
        return spent_s * (STUCK if is_stuck else 1.0) - self._dual_timer.spent_s

    def repeat(self, slice_: int) -> Allocation | None:
        """Run both sides as `run` does, with effort counted rather than timed."""
        if not self._descended:
            return self._descend()
        if self._primal is not None:
            self._primal.anneal(REPEATABLE_ROUNDS, slice_ / REPEATABLE_SLICES)
        self._raise_bound(REPEATABLE_ROUNDS)
        return self._better()

    def note_plan(self, plan: Allocation, cost: float) -> None:
        """Record a submitted plan and its cost."""
        if cost <= self._cost:
            is_better = cost < self._cost * (1 - 1e-9)
            self._plan, self._cost = plan, cost
            if self._primal is not None and is_better and cost < self._primal.cost * (1 - 1e-9):
                self._primal.adopt(self._model.columns(plan))
            if self._dual is not None and self._cuts is not None and is_better:
                self._cuts.note_plan(self._counts[self._dual.kept])

    def _descend(self) -> Allocation | None:
        """Descend before prices are updated, as step sizes depend on the cost of the incumbent plan."""
        assert self._primal is not None
        self._descended = self._primal.descend()
        return self._better()

    def _ascend(self) -> None:
        self._dual_timer.run(self._raise_bound)

    def _raise_bound(self, rounds: int) -> None:
        """Run the dual side: subgradient steps and, once prices are nearly optimal, cutting planes."""
        if self._dual is None:
            return
        if self._cuts is None and self._dual.is_nearly_optimal and self._dual.may_be_cut:
            self._cuts = self._dual.cutting_planes(self._counts, self._should_stop)
            self._cuts.ascend(1, self._cost)  # only one, as this turn also builds the programme
        elif self._cuts is None:
            self._dual.ascend(rounds, self._cost)
        else:
            self._cuts.ascend(min(rounds, MAX_CUT_ROUNDS), self._cost)

    def _better(self) -> Allocation | None:
        """Return the best plan if it is new; restrict the primal side to pairs that a better plan may use."""
        if self._primal is not None and self._cuts is not None and self._cuts.least_with is not self._least_with:
            self._least_with = self._cuts.least_with
            pairs = self._kept[self._least_with <= self._cost]
            allowed = np.zeros((len(self._demand.count), len(self._model.tasks)), dtype=bool)
            allowed[self._demand.class_of_pair[pairs], self._demand.task_of_pair[pairs]] = True
            self._primal.restrict(allowed[self._model.classes.class_of_agent])
        if self._primal is None or self._primal.cost >= self._reported * (1 - 1e-12):
            return None
        self._reported, self._improved_s = self._primal.cost, self._primal_timer.spent_s
        return self._model.plan_of(self._primal.best)

    @property
    def _counts(self) -> IntArray:
        """Return the agents of each pair of the dual side in the best plan."""
        return self._model.counts(self._demand, self._plan)[self._pairs]

    def _begin_dual(self, task_distance: FloatArray, seconds: float) -> LagrangianBound | None:
        """Return the dual side; None if its tables are too large."""
        cost = self._model.cost[self._model.pairs_at(self._demand)]
        rounded, pairs = round_demand(self._demand, cost)
        cells = np.maximum(rounded.need, rounded.max_weight) if rounded.is_whole else np.full(len(rounded.need), STATES)
        if cells[rounded.task_of_pair].sum() > MAX_WORK:
            return None
        self._pairs = pairs
        return LagrangianBound(rounded, task_distance, class_prices(self._demand, cost, seconds))


def _cost_of_plan(instance: Instance, plan: Allocation) -> float:
    """Return the cost of the flights of a plan, in units of distance."""
    sent = np.flatnonzero(plan.task_of_agent != IDLE)
    return float(instance.reach.cost_of(sent, plan.task_of_agent[sent]).sum())
