"""The state that the phases of the makespan stage pass along."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.exact.local_search import LocalSearchPhase
from alloc.allocators.exact.makespan.ascent import ConfigurationAscent
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.repartition.search import RepartitionSearch
from alloc.allocators.exact.model import FEW_PAIRS, Model
from alloc.allocators.exact.monitor import is_over
from alloc.allocators.exact.solver_model import Verdict, is_repeatable
from alloc.problems import Allocation, Evaluation, Objective, agent_classes
from alloc.problems.instance import FloatArray

TIGHT = 1e-8
"""Relative gap at which the stage ends; well above the tolerance of 1e-9 that solvers and scores have."""

UNLIMITED_S = 60.0
"""Seconds of which phases get their shares where there is no time limit."""

LEAST_WEIGHT = 1 / 8
"""Part of its usual time that a phase which finds nothing still gets."""

LEAST_SHARE = 0.2
"""Part of the stage that the time until the fastest plan was found counts as at least, where patience is limited."""

TELLING_SHARE = 0.05
"""Share of the time from which on it tells something that local search finds nothing."""


@dataclass(eq=False)
class MakespanState:
    """Bounds on the least makespan, and what the phases need to improve them; plans go to `search`.

    Attributes
    ----------
    search : Search
    model : Model
        Classes not told apart by place.
    begin_s, until_s : float
        Seconds since the run began at which the stage began and must end; the latter ``inf`` without a time limit.
    patience : float
        Time without a faster plan, as a multiple of the time until the fastest was found, after which the stage ends.
    descent : bool
        Whether plans are looked for without the solver.
    repeatable : bool
        Whether effort is counted and not timed.
    rng : numpy.random.Generator
    repartition : RepartitionSearch
    lower : float
        Proven: no plan that serves `model.min_served` tasks has a smaller makespan, in hours.
    unresolved : float
        Least makespan above the largest T whose probe ended without a verdict; no bound, but the lower end of the
        bisection.
    bounds_tried : bool
        Whether linear programmes have been used for a bound; after that, a probe tries more before the solver.
    bounds_converged : bool
        Whether the configuration linear programme has nothing more to prove.
    configurations : ConfigurationProgramme or None
        None before that, and where the programme is too large.
    price : ndarray, shape (t,), or None
        Value of a unit of each workload by the linear programme of single agents, where that was solved.
    ascent : ConfigurationAscent or None
        None before it is needed.
    local_search : LocalSearchPhase or None
        None where the solver is quick enough by itself, or must find plans alone, or some tasks stay unserved.
    local_weight : float
        Part of its usual time that local search gets: less after each turn that found nothing.
    """

    search: Search
    model: Model
    begin_s: float
    until_s: float
    patience: float
    descent: bool
    repeatable: bool
    rng: np.random.Generator
    repartition: RepartitionSearch
    lower: float
    unresolved: float = 0.0
    bounds_tried: bool = False
    bounds_converged: bool = False
    configurations: ConfigurationProgramme | None = None
    price: FloatArray | None = None
    ascent: ConfigurationAscent | None = None
    local_search: LocalSearchPhase | None = None
    local_weight: float = 1.0

    @classmethod
    def begin(
        cls, search: Search, min_served: int, until_s: float, patience: float = np.inf, *, descent: bool
    ) -> "MakespanState":
        """Start from the simple bound and the best plan of `search`."""
        model = Model.build(search.instance, agent_classes(search.instance, by_place=False), min_served)
        return cls(
            search=search,
            model=model,
            begin_s=search.elapsed_s,
            until_s=until_s,
            patience=patience,
            descent=descent,
            repeatable=is_repeatable(search),
            rng=np.random.default_rng(search.seed),
            repartition=RepartitionSearch(model, search.seed),
            lower=_simple_bound(search, model),
        )

    @property
    def plan(self) -> Allocation:
        """The fastest plan so far."""
        assert self.search.fastest is not None
        return self.search.fastest.allocation

    @property
    def upper(self) -> float:
        """Makespan of the fastest plan so far, in hours."""
        assert self.search.fastest is not None
        return self.search.fastest.evaluation.served_makespan

    @property
    def closed(self) -> bool:
        """Whether the fastest plan is proven, or keeps to the limit that was given."""
        given = self.search.tolerance.limit
        return self.upper <= max(self.lower * (1 + TIGHT), given or 0.0)

    @property
    def over(self) -> bool:
        """Whether time or patience is at its end, or the run must end."""
        return is_over(self.search) or self.search.elapsed_s >= self.until_s or self.has_stalled

    @property
    def has_stalled(self) -> bool:
        """Whether no faster plan has been found for so long that patience is at its end.

        Not where abilities are multiples of a unit: there a proof may come at any time.
        """
        if np.isinf(self.patience) or np.isinf(self.until_s) or self.model.unit is not None:
            return False
        assert self.search.fastest is not None
        last_s = max(self.begin_s, self.search.fastest.time_s)
        took_s = max(last_s - self.begin_s, LEAST_SHARE * (self.until_s - self.begin_s))
        return self.search.elapsed_s - last_s > self.patience * took_s

    @property
    def ended(self) -> bool:
        """Whether nothing is left to do."""
        return self.closed or self.over

    @property
    def partial(self) -> bool:
        """Whether some tasks stay unserved."""
        return self.model.min_served < len(self.model.tasks)

    def would_prove(self, time: float) -> bool:
        """Whether a lower bound of `time` would prove the fastest plan to 1e-6."""
        return self.upper - time <= PROVEN * self.upper

    def rule_out(self, time: float) -> None:
        """Take note that no plan has a makespan of `time` or less."""
        self.rule_out_below(self.model.next_makespan(time))

    def rule_out_below(self, time: float) -> None:
        """Take note that no plan has a makespan less than `time`."""
        self.lower = max(self.lower, time)
        if not self.partial:
            self.search.raise_bound(min(self.lower, self.upper))

    def submit(self, plan: Allocation, time: float) -> bool:
        """Submit a plan; return whether it serves enough tasks by `time`."""
        return self._in_time(self.search.submit(plan), time)

    def verdict_on(self, plan: Allocation, time: float) -> Verdict:
        """Submit a solver's plan for `time`; by rounding, it may be too slow, or no faster than the fastest."""
        upper, score = self.upper, self.search.submit(plan)
        faster = self._in_time(score, time) and score.served_makespan < upper
        return Verdict.FEASIBLE if faster else Verdict.UNKNOWN

    def _in_time(self, score: Evaluation, time: float) -> bool:
        served = len(self.model.tasks) - len(score.unserved_tasks)
        return served >= self.model.min_served and score.served_makespan <= time * (1 + TIGHT / 4)

    @contextmanager
    def with_local_search(self) -> Iterator[None]:
        """Have local search at hand in the block."""
        if not self.descent or self.partial or len(self.model.class_of_pair) <= FEW_PAIRS:
            yield
            return
        with LocalSearchPhase(self.search, Objective.MAKESPAN, self.until_s) as self.local_search:
            yield
        self.local_search = None

    def search_locally(self, share: float) -> None:
        """Improve the fastest plan by local search for this share of the time, where it is at hand."""
        if self.local_search is not None and not self.ended:
            upper = self.upper
            self.local_search.turn(self.share_s(share * self.local_weight, 0.08))
            if share >= TELLING_SHARE or self.upper < upper:
                self.local_weight = reweighted(self.local_weight, found=self.upper < upper)

    def share_s(self, share: float, least_s: float = 0.1) -> float:
        """Return this share of the stage's time in seconds, at least `least_s`; ``inf`` where effort is counted."""
        if self.repeatable:
            return float("inf")
        return max(least_s, share * (self.until_s if np.isfinite(self.until_s) else UNLIMITED_S))


def reweighted(weight: float, *, found: bool) -> float:
    """Return the part of its usual time that a phase gets next: all of it where its last turn found something."""
    return 1.0 if found else max(LEAST_WEIGHT, weight / 2)


def _simple_bound(search: Search, model: Model) -> float:
    """All abilities against the smallest workloads that are to be served."""
    if model.min_served == len(model.tasks):
        return search.lower_bound
    least = np.sort(model.workload)[: model.min_served].sum()
    return float(least / (model.classes.ability @ model.classes.count))
