"""The makespan that games on regions are to reach: the lower bound first, then what seems achievable."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.contract.search import Search
from alloc.allocators.learned.play.reference import reference_makespan
from alloc.problems import IDLE, Instance, Objective
from alloc.problems.game.layout import SHORTEST_HOURS, working_share

Ints = NDArray[np.int64]

BOUND_UNLIMITED_S = 30.0
"""Seconds that the first bound may take where there is no time limit: runs that count iterations have to repeat."""

BOUND_SHARE = 0.1
"""Share of the time limit that the first bound may take."""

ROUNDING = 1e-9
"""Share of the need by which a group may differ and still count as sufficient."""

CHECK_SHARE, CHECK_SWEEPS = 0.1, 5
"""Share of the budget, and sweeps, between two checks of how far the shortfall has fallen."""

TOO_SLOW = 0.5
"""Share of the shortfall at the last check below which it must be at the next, or the target is given up."""

SMALL_SHORTFALL, FEW_TASKS = 0.002, 0.1
"""A shortfall is small, so that only patience ends a target, if it is no more than this share of all needs or one mean
ability, and no more than this share of the tasks, or two tasks, are short."""

GRACE_SWEEPS = 5
"""Sweeps without success that do not count as stagnation."""


class TargetMakespan:
    """The makespan that games on regions are to reach, as a run goes on.

    The first target is the best lower bound. A target is given up on stagnation, or where the shortfall falls too
    slowly; the next one is halfway to the makespan reached. Once no better makespan is possible, or most of the budget
    is spent, the target is the makespan reached, and games are for energy, if the objective has it.

    Parameters
    ----------
    search : Search
    instance : Instance
        Of the search, without what cannot be served.
    patience : int
        Sweeps over all regions without success after which a target is given up.
    makespan_share : float
        Share of the budget after which energy counts even if the makespan may not be the least.

    Attributes
    ----------
    hours : float
        The target.
    failed : float
        A makespan that could not be reached, or is a lower bound.
    stale : int
        Sweeps since the shortfall last fell.
    """

    def __init__(self, search: Search, instance: Instance, patience: int, makespan_share: float) -> None:
        self.search, self.instance = search, instance
        self.patience, self.makespan_share = patience, makespan_share
        self._mean_ability = float(instance.ability.mean())
        bound = self._bound()
        if instance is search.instance:
            search.raise_bound(bound)
        self.failed = max(bound, self._given_limit())
        self._start(self.failed)

    def _bound(self) -> float:
        limit = self.search.budget.time_limit_s
        return reference_makespan(self.instance, BOUND_UNLIMITED_S if limit is None else BOUND_SHARE * limit)

    def _given_limit(self) -> float:
        """Hours that the user gave, up to which a plan need be no faster."""
        energy_counts = self.search.objective is Objective.MAKESPAN_ENERGY
        return self.search.tolerance.limit or 0.0 if energy_counts else 0.0

    def _start(self, hours: float) -> None:
        """Set a new target, and start its counters."""
        self.hours, self.stale = hours, 0
        self.least_shortfall = self._shortfall_at_check = np.inf
        self._checked, self._sweeps, self._short_tasks = self.spent, 0, 0

    def update(self, plan: Ints) -> bool:
        """Choose the target for the next sweep; return whether games are for energy alone from here on."""
        search = self.search
        assert search.fastest is not None
        reached = search.fastest.evaluation.served_makespan
        if search.objective is Objective.MAKESPAN_ENERGY and (
            reached <= self.failed * (1 + ROUNDING) or self.spent > self.makespan_share
        ):
            self.hours = search.makespan_limit
            return True
        if reached <= self.hours * (1 + ROUNDING):
            self._start((self.failed + reached) / 2)
        elif self.stale >= self.patience or self._is_too_slow():
            self.failed = self.hours
            self._start((self.hours + reached) / 2)
        elif self.hours < (balanced := self._balanced(plan)) * (1 - ROUNDING):
            self.hours = min(balanced, (self.hours + reached) / 2)
        return False

    def surplus(self, plan: Ints) -> NDArray[np.float64]:
        """Return the ability at each task beyond its need at the target, negative for a shortfall, shape (m,).

        It is 0 for a task without anyone: the plan serves as many tasks as can be, and no region of it serves more.
        """
        instance = self.instance
        agent = np.flatnonzero(plan != IDLE)
        share = working_share(instance.speed[agent], instance.reach.distance_of(agent, plan[agent]), self.hours)
        group = np.bincount(plan[agent], instance.ability[agent] * share, minlength=instance.m)
        with np.errstate(over="ignore"):
            need = instance.workload / max(self.hours, SHORTEST_HOURS)
        alone = np.bincount(plan[agent], minlength=instance.m) == 0
        return np.where(alone | (np.abs(group - need) <= ROUNDING * need), 0.0, group - need)

    def record(self, surplus: NDArray[np.float64]) -> None:
        """Record the shortfall of a plan before a sweep."""
        shortfall = float(-surplus[surplus < 0].sum())
        self.stale = 0 if shortfall < self.least_shortfall else self.stale + 1
        self.least_shortfall = min(shortfall, self.least_shortfall)
        self._short_tasks = int((surplus < 0).sum())
        self._sweeps += 1

    @property
    def stagnation(self) -> float:
        """How much of the patience is used up, from 0 to 1."""
        return min(1.0, max(0, self.stale - GRACE_SWEEPS) / max(1, self.patience - GRACE_SWEEPS))

    def _is_too_slow(self) -> bool:
        """Whether, at a check, the shortfall has not fallen by enough since the last one and is not small."""
        if self._sweeps < CHECK_SWEEPS or self.spent - self._checked < CHECK_SHARE:
            return False
        small = 0.0
        if self._short_tasks <= max(2, FEW_TASKS * self.instance.m):
            workload = float(self.instance.workload.sum())
            small = max(self._mean_ability, SMALL_SHORTFALL * workload / max(self.hours, SHORTEST_HOURS))
        slow = self.least_shortfall > max(TOO_SLOW * self._shortfall_at_check, small)
        self._checked, self._sweeps, self._shortfall_at_check = self.spent, 0, self.least_shortfall
        return slow

    def _balanced(self, plan: Ints) -> float:
        """Hours that the plan would take with its work divided evenly, flights included; 0 without finite speeds."""
        instance = self.instance
        agent = np.flatnonzero(plan != IDLE)
        if not np.isfinite(instance.speed).any() or not len(agent):
            return 0.0
        ability = instance.ability[agent]
        flight = instance.reach.distance_of(agent, plan[agent]) / instance.speed[agent]
        return float((instance.workload.sum() + ability @ flight) / ability.sum())

    @property
    def spent(self) -> float:
        """Share of the budget that is spent."""
        search, budget = self.search, self.search.budget
        of_time = search.elapsed_s / budget.time_limit_s if budget.time_limit_s else 0.0
        return max(of_time, search.iteration / budget.iterations if budget.iterations else 0.0)
