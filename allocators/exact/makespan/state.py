"""The shared state of the phases of the makespan stage."""

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
"""Relative gap at which the stage ends, well above the tolerance of solvers and scores, 1e-9."""

UNLIMITED_S = 60.0
"""Seconds to which the shares of phases refer without a time limit."""

MIN_WEIGHT = 1 / 8
"""Smallest weight of a phase that finds nothing, relative to its usual time."""

MIN_SHARE = 0.2
"""Lower limit, as a share of the stage, on the time until the fastest plan in the criterion of patience."""

TELLING_SHARE = 0.05
"""Share of the time from which a turn of local search without success is significant."""


@dataclass(eq=False)
class MakespanState:
    """Bounds on the least makespan, and the data that phases need to improve them; plans go to `search`.

    Attributes
    ----------
    search : Search
    model : Model
        Classes that do not distinguish places.
    begin_s, until_s : float
        Seconds since the run began at which the stage began and must end; the latter ``inf`` without a time limit.
    patience : float
        Time without a faster plan, as a multiple of the time until the fastest was found, after which the stage ends.
    descent : bool
        Whether to search for plans without the solver.
    repeatable : bool
        Whether effort is counted rather than timed.
    rng : numpy.random.Generator
    repartition : RepartitionSearch
    lower : float
        Proven lower bound, in hours, on the makespan of plans that serve `model.min_served` tasks.
    unresolved : float
        Least makespan above the largest T whose probe ended without a verdict; not a bound, but the lower end of the
        bisection.
    bounds_tried : bool
        Whether linear programmes have been used for a bound; after that, probes try more before the solver.
    bounds_converged : bool
        Whether the configuration linear programme cannot raise the bound further.
    configurations : ConfigurationProgramme or None
        None before that, and if the programme is too large.
    price : ndarray, shape (t,), or None
        Value of a unit of each workload by the linear programme of single agents, if that was solved.
    ascent : ConfigurationAscent or None
        None before it is needed.
    local_search : LocalSearchPhase or None
        None if the solver is fast enough by itself or is to find plans alone, or if some tasks stay unserved.
    local_weight : float
        Weight of local search relative to its usual time, reduced after each turn that found nothing.
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
        """Whether the fastest plan is proven optimal, or within the given makespan limit."""
        given = self.search.tolerance.limit
        return self.upper <= max(self.lower * (1 + TIGHT), given or 0.0)

    @property
    def over(self) -> bool:
        """Whether time or patience has run out, or the run must end."""
        return is_over(self.search) or self.search.elapsed_s >= self.until_s or self.has_stalled

    @property
    def has_stalled(self) -> bool:
        """Whether patience has run out without a faster plan.

        Never if abilities are multiples of a unit, as a proof may then come at any time.
        """
        if np.isinf(self.patience) or np.isinf(self.until_s) or self.model.unit is not None:
            return False
        assert self.search.fastest is not None
        last_s = max(self.begin_s, self.search.fastest.time_s)
        took_s = max(last_s - self.begin_s, MIN_SHARE * (self.until_s - self.begin_s))
        return self.search.elapsed_s - last_s > self.patience * took_s

    @property
    def ended(self) -> bool:
        """Whether the stage has ended."""
        return self.closed or self.over

    @property
    def partial(self) -> bool:
        """Whether some tasks stay unserved."""
        return self.model.min_served < len(self.model.tasks)

    def would_prove(self, time: float) -> bool:
        """Whether a lower bound of `time` would prove the fastest plan optimal to 1e-6."""
        return self.upper - time <= PROVEN * self.upper

    def rule_out(self, time: float) -> None:
        """Record that no plan has a makespan of `time` or less."""
        self.rule_out_below(self.model.next_makespan(time))

    def rule_out_below(self, time: float) -> None:
        """Record that no plan has a makespan less than `time`."""
        self.lower = max(self.lower, time)
        if not self.partial:
            self.search.raise_bound(min(self.lower, self.upper))

    def submit(self, plan: Allocation, time: float) -> bool:
        """Submit a plan; return whether it serves enough tasks by `time`."""
        return self._in_time(self.search.submit(plan), time)

    def verdict_on(self, plan: Allocation, time: float) -> Verdict:
        """Submit a solver's plan for `time`, which by rounding may be too slow; return the verdict."""
        upper, score = self.upper, self.search.submit(plan)
        faster = self._in_time(score, time) and score.served_makespan < upper
        return Verdict.FEASIBLE if faster else Verdict.UNKNOWN

    def _in_time(self, score: Evaluation, time: float) -> bool:
        served = len(self.model.tasks) - len(score.unserved_tasks)
        return served >= self.model.min_served and score.served_makespan <= time * (1 + TIGHT / 4)

    @contextmanager
    def with_local_search(self) -> Iterator[None]:
        """Make local search available within the block."""
        if not self.descent or self.partial or len(self.model.class_of_pair) <= FEW_PAIRS:
            yield
            return
        with LocalSearchPhase(self.search, Objective.MAKESPAN, self.until_s) as self.local_search:
            yield
        self.local_search = None

    def search_locally(self, share: float) -> None:
        """Improve the fastest plan by local search, if available, for this share of the time."""
        if self.local_search is not None and not self.ended:
            upper = self.upper
            self.local_search.turn(self.share_s(share * self.local_weight, 0.08))
            if share >= TELLING_SHARE or self.upper < upper:
                self.local_weight = reweighted(self.local_weight, found=self.upper < upper)

    def share_s(self, share: float, least_s: float = 0.1) -> float:
        """Return this share of the stage's time in seconds, at least `least_s`; ``inf`` in repeatable runs."""
        if self.repeatable:
            return float("inf")
        return max(least_s, share * (self.until_s if np.isfinite(self.until_s) else UNLIMITED_S))


def reweighted(weight: float, *, found: bool) -> float:
    """Return the next weight of a phase: 1 if its last turn found something, otherwise less."""
    return 1.0 if found else max(MIN_WEIGHT, weight / 2)


def _simple_bound(search: Search, model: Model) -> float:
    """Return the bound by total ability and the smallest workloads that must be served."""
    if model.min_served == len(model.tasks):
        return search.lower_bound
    least = np.sort(model.workload)[: model.min_served].sum()
    return float(least / (model.classes.ability @ model.classes.count))
