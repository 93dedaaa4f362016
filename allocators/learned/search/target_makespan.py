"""The target makespan of games on regions: first the lower bound, then what appears to be achievable."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.contract.search import Search
from alloc.allocators.learned.play.reference import reference_makespan
from alloc.problems import IDLE, Instance, Objective
from alloc.problems.game.layout import SHORTEST_HOURS, working_share

Ints = NDArray[np.int64]

BOUND_UNLIMITED_S = 30.0
"""Seconds for the first bound without a time limit, enough for runs limited by iterations to be reproducible."""

BOUND_SHARE = 0.1
"""Share of the time limit for the first bound."""

ROUNDING = 1e-9
"""Relative tolerance on the need of a task."""

CHECK_SHARE, CHECK_SWEEPS = 0.1, 5
"""Share of the budget, and number of sweeps, between two checks of the decrease of the shortfall."""

TOO_SLOW = 0.5
"""The target is given up if the shortfall at a check exceeds this share of that at the previous check."""

SMALL_SHORTFALL, FEW_TASKS = 0.002, 0.1
"""A shortfall is small, so that a target is given up only after `patience` sweeps, if it is at most this share of all
needs or one mean ability, and at most this share of the tasks, or two tasks, are short."""

GRACE_SWEEPS = 5
"""Number of sweeps without success that do not count as stagnation."""


class TargetMakespan:
    """The target makespan of games on regions in the course of a run.

    The first target is the best lower bound. A target is given up on stagnation, or if the shortfall decreases too
    slowly; the next one is halfway to the best makespan so far. When no better makespan is possible, or most of the
    budget is spent, the target is the best makespan so far, and games minimise energy if it is part of the objective.

    Parameters
    ----------
    search : Search
    instance : Instance
        Instance of the search, without tasks that cannot be served.
    patience : int
        Number of sweeps over all regions without success after which a target is given up.
    makespan_share : float
        Share of the budget after which games are for energy even if the makespan may not be minimal.

    Attributes
    ----------
    hours : float
        The target makespan.
    failed : float
        A makespan that could not be reached, or a lower bound.
    stale : int
        Number of sweeps since the shortfall last decreased.
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
        """Return the makespan limit of the user in hours, below which a plan need not be faster; 0 without one."""
        energy_counts = self.search.objective is Objective.MAKESPAN_ENERGY
        return self.search.tolerance.limit or 0.0 if energy_counts else 0.0

    def _start(self, hours: float) -> None:
        """Set a new target, and start its counters."""
        self.hours, self.stale = hours, 0
        self.least_shortfall = self._shortfall_at_check = np.inf
        self._checked, self._sweeps, self._short_tasks = self.spent, 0, 0

    def update(self, plan: Ints) -> bool:
        """Choose the target of the next sweep; return whether games are only for energy from now on."""
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
        """Return the ability at each task minus its need at the target, shape (m,); negative for a shortfall.

        It is 0 for a task without agents: the plan serves as many tasks as possible, so no region can serve more.
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
        """Used share of the patience, from 0 to 1."""
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
        """Return the makespan of the plan with evenly divided work, including flights; 0 without finite speeds."""
        instance = self.instance
        agent = np.flatnonzero(plan != IDLE)
        if not np.isfinite(instance.speed).any() or not len(agent):
            return 0.0
        ability = instance.ability[agent]
        flight = instance.reach.distance_of(agent, plan[agent]) / instance.speed[agent]
        return float((instance.workload.sum() + ability @ flight) / ability.sum())

    @property
    def spent(self) -> float:
        """Used share of the budget."""
        search, budget = self.search, self.search.budget
        of_time = search.elapsed_s / budget.time_limit_s if budget.time_limit_s else 0.0
        return max(of_time, search.iteration / budget.iterations if budget.iterations else 0.0)
