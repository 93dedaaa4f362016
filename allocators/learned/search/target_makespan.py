"""Which makespan games are to reach: the least possible first, and then what seems within reach."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.contract.search import Search
from alloc.allocators.learned.training.curriculum import reference_makespan
from alloc.problems import IDLE, Instance, Objective
from alloc.problems.game.board import working_share

Ints = NDArray[np.int64]

UNHURRIED_S = 30.0
"""Seconds that the first bound may take where there is no time limit: runs that count iterations have to repeat."""

BOUND_SHARE = 0.1
"""Share of the time limit that the first bound may take."""

ROUNDING = 1e-9
"""Share of the need by which a group may be off and still be right."""

CHECK_SHARE, CHECK_SWEEPS = 0.1, 5
"""Share of the budget, and sweeps, after which it is asked how much of what was lacking still is."""

TOO_SLOW = 0.5
"""Share of what was lacking at the last check that must be gone by the next, or the aim is given up."""

LITTLE, FEW = 0.002, 0.1
"""What is lacking is a rest, for which only patience counts, if it is no more than this share of all that is needed, or
one mean ability, and no more than this share of the tasks lack it, or two."""

UNCONCERNED = 5
"""Sweeps without success that mean nothing."""


class Aims:
    """The makespan that games on parts aim at, as a run goes on.

    The first aim is the best lower bound. An aim is given up when nothing gets better or it comes too slowly; the next
    one is halfway to the makespan reached. Once that is as good as it gets, or most of the budget is spent, energy
    counts, if it does at all.

    Parameters
    ----------
    search : Search
    instance : Instance
        Of the search, without what cannot be served.
    patience : int
        Sweeps over all parts without success after which an aim is given up.
    makespan_share : float
        Share of the budget after which energy counts even if the makespan may not be the least.

    Attributes
    ----------
    hours : float
        The aim.
    failed : float
        A makespan that could not be reached, or is a lower bound.
    stale : int
        Sweeps since less was lacking.
    """

    def __init__(self, search: Search, instance: Instance, patience: int, makespan_share: float) -> None:
        self.search, self.instance = search, instance
        self.patience, self.makespan_share = patience, makespan_share
        self._mean_ability = float(instance.ability.mean())
        bound = self._bound()
        if instance is search.instance:
            search.raise_bound(bound)
        self.failed = max(bound, self._given_limit())
        self._aim_at(self.failed)

    def _bound(self) -> float:
        limit = self.search.budget.time_limit_s
        return reference_makespan(self.instance, UNHURRIED_S if limit is None else BOUND_SHARE * limit)

    def _given_limit(self) -> float:
        """Hours that the user gave, up to which a plan need be no faster."""
        energy_counts = self.search.objective is Objective.MAKESPAN_ENERGY
        return self.search.tolerance.limit or 0.0 if energy_counts else 0.0

    def _aim_at(self, hours: float) -> None:
        self.hours, self.stale = hours, 0
        self.least_shortfall = self._shortfall_then = np.inf
        self._checked, self._sweeps, self._lacking = self.spent, 0, 0

    def set(self, plan: Ints) -> bool:
        """Decide on the aim; return whether it is all about energy from here on."""
        search = self.search
        assert search.fastest is not None
        reached = search.fastest.evaluation.served_makespan
        if search.objective is Objective.MAKESPAN_ENERGY and (
            reached <= self.failed * (1 + ROUNDING) or self.spent > self.makespan_share
        ):
            self.hours = search.makespan_limit
            return True
        if reached <= self.hours * (1 + ROUNDING):
            self._aim_at((self.failed + reached) / 2)
        elif self.stale >= self.patience or self._is_too_slow():
            self.failed = self.hours
            self._aim_at((self.hours + reached) / 2)
        elif self.hours < (balanced := self._balanced(plan)) * (1 - ROUNDING):
            self.hours = min(balanced, (self.hours + reached) / 2)
        return False

    def surplus(self, plan: Ints) -> NDArray[np.float64]:
        """Return the ability that each task has too much for the aim, negative where it lacks some, shape (m,).

        A task without anyone lacks nothing: the plan serves as many tasks as can be, and no part of it serves more.
        """
        instance = self.instance
        agent = np.flatnonzero(plan != IDLE)
        share = working_share(instance.speed[agent], instance.reach.distance_of(agent, plan[agent]), self.hours)
        group = np.bincount(plan[agent], instance.ability[agent] * share, minlength=instance.m)
        with np.errstate(over="ignore"):
            need = instance.workload / max(self.hours, 1e-300)
        alone = np.bincount(plan[agent], minlength=instance.m) == 0
        return np.where(alone | (np.abs(group - need) <= ROUNDING * need), 0.0, group - need)

    def note(self, surplus: NDArray[np.float64]) -> None:
        """Note what a plan lacks, before a sweep."""
        shortfall = float(-surplus[surplus < 0].sum())
        self.stale = 0 if shortfall < self.least_shortfall else self.stale + 1
        self.least_shortfall = min(shortfall, self.least_shortfall)
        self._lacking = int((surplus < 0).sum())
        self._sweeps += 1

    @property
    def in_vain(self) -> float:
        """How much of the patience is used up, from 0 to 1."""
        return min(1.0, max(0, self.stale - UNCONCERNED) / max(1, self.patience - UNCONCERNED))

    def _is_too_slow(self) -> bool:
        """Whether most of what was lacking a while ago still is, and that is more than a rest."""
        if self._sweeps < CHECK_SWEEPS or self.spent - self._checked < CHECK_SHARE:
            return False
        rest = 0.0
        if self._lacking <= max(2, FEW * self.instance.m):
            rest = max(self._mean_ability, LITTLE * float(self.instance.workload.sum()) / max(self.hours, 1e-300))
        slow = self.least_shortfall > max(TOO_SLOW * self._shortfall_then, rest)
        self._checked, self._sweeps, self._shortfall_then = self.spent, 0, self.least_shortfall
        return slow

    def _balanced(self, plan: Ints) -> float:
        """Hours that the plan would take if its work were shared out without a rest, flights included; 0 without."""
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
