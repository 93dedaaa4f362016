"""One run of a method on an instance: clock, budget, best allocation so far, and stop requests."""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.improvement import Improvement, TracePoint
from alloc.allocators.contract.tolerance import EXACT, PROVEN, MakespanTolerance, relative_gap
from alloc.problems import (
    Allocation,
    Evaluation,
    Instance,
    Objective,
    evaluate,
    makespan_lower_bound,
    serve_all,
)
from alloc.problems.evaluation import RELATIVE_TOLERANCE, last_equal

STANDS = "the best plan up to then stands"
"""End of the note on a stage that failed after a plan was found."""

_log = logging.getLogger("alloc")


class Search:
    """A run as a method sees it; created by `solve`.

    Parameters
    ----------
    instance, objective, budget, seed, start, threads, tolerance
        See the attributes below.
    on_improvement : callable, optional
        Called with every new best allocation.
    stop : threading.Event, optional
        Setting it ends the run.
    spent_s : float
        Seconds of the run that have passed already.

    Attributes
    ----------
    instance : Instance
    objective : Objective
    budget : Budget
    seed : int
    start : Allocation or None
        A warm start, already submitted; agents whose task in it was one that they cannot do are idle.
    threads : int
        Threads that the method may use.
    lower_bound : float
        Best known lower bound on the makespan of allocations that serve all tasks, in hours.
    best : Improvement or None
        The best allocation submitted so far.
    fastest : Improvement or None
        The allocation with the least makespan among those that leave the fewest and least urgent tasks unserved;
        differs from `best` only if energy counts.
    tolerance : MakespanTolerance
        How much slower than `fastest` `best` may be.
    iteration : int
        Number of iterations so far, counted by the method in its own unit.
    trace : list of TracePoint
        Figures of every improvement, in order.
    notes : list of str
        Messages for the user.
    """

    def __init__(
        self,
        instance: Instance,
        objective: Objective,
        budget: Budget,
        *,
        seed: int = 0,
        start: Allocation | None = None,
        threads: int = 1,
        tolerance: MakespanTolerance = EXACT,
        on_improvement: Callable[[Improvement], None] | None = None,
        stop: threading.Event | None = None,
        spent_s: float = 0.0,
    ) -> None:
        self._begin = time.monotonic() - spent_s  # choosing the method is part of the run
        self.instance, self.objective, self.budget = instance, objective, budget
        self.tolerance = tolerance
        self.seed, self.start, self.threads = seed, start, threads
        self._on_improvement, self._stop = on_improvement, stop or threading.Event()
        self._is_ended = False
        self.iteration = 0
        self.best: Improvement | None = None
        self.fastest: Improvement | None = None
        self._front: list[Improvement] = []  # candidates for `best` when `fastest` changes
        self.trace: list[TracePoint] = []
        self.notes: list[str] = []
        self._callback_failed = False  # whether `on_improvement` raised an exception
        self._is_met: Callable[[Search], bool] = lambda _: False
        self._is_proven = False
        self.lower_bound = makespan_lower_bound(instance)
        if start is not None:
            evaluate(instance, start)  # raises if the sizes do not fit
            # agents that cannot do their tasks become idle
            self.start = serve_all(instance, start, lambda: self.remaining_s)
            self.submit(self.start)

    @property
    def elapsed_s(self) -> float:
        """Seconds since the run began."""
        return time.monotonic() - self._begin

    @property
    def remaining_s(self) -> float:
        """Seconds until the time limit, at least 0; ``inf`` without a limit."""
        limit = self.budget.time_limit_s
        return float("inf") if limit is None else max(0.0, limit - self.elapsed_s)

    @property
    def interrupted(self) -> bool:
        """Whether a stop was requested, by a signal or the `stop` event."""
        return self._is_ended or self._stop.is_set()

    @property
    def makespan_limit(self) -> float:
        """Makespan up to which allocations count as equally fast, so that energy decides; ``inf`` before the first."""
        return math.inf if self.fastest is None else self.tolerance.hours(self.fastest.evaluation.served_makespan)

    def part(
        self,
        objective: Objective,
        tolerance: MakespanTolerance,
        on_improvement: Callable[[Improvement], None] | None = None,
        budget: Budget | None = None,
    ) -> "Search":
        """Return a separate run on the same instance, with the same clock, stop event and best plans.

        For running another method within this run, possibly in another thread.

        Parameters
        ----------
        objective, tolerance, on_improvement
            Those of the part; improvements are not submitted to this run.
        budget : Budget, optional
            Its time limit is measured on the clock of this run; by default the time limit of this run and no other.
        """
        part = Search(
            self.instance,
            objective,
            budget or Budget(self.budget.time_limit_s),
            seed=self.seed,
            tolerance=tolerance,
            stop=self._stop,
            spent_s=self.elapsed_s,
        )
        part.raise_bound(self.lower_bound)
        for known in (self.fastest, self.best):
            if known is not None:
                part.submit(known.allocation)
        part._on_improvement = on_improvement
        return part

    def end(self) -> None:
        """End this run, but not the run that it is a part of; may be called from any thread."""
        self._is_ended = True

    def end_when(self, is_met: Callable[["Search"], bool]) -> None:
        """End this run as soon as `is_met` returns true; it is called now, and after every new best."""
        self._is_met = is_met
        self._is_proven = is_met(self)

    def submit(self, allocation: Allocation) -> Evaluation:
        """Score `allocation`, and record and report it if it is the best so far.

        Parameters
        ----------
        allocation : Allocation

        Returns
        -------
        Evaluation
        """
        evaluation = evaluate(self.instance, allocation)
        found = Improvement(self.elapsed_s, allocation, evaluation, self.lower_bound)
        if self.fastest is None or evaluation.is_better_than(self.fastest.evaluation, Objective.MAKESPAN):
            self.fastest = found
        candidates = [found]
        if self.tolerance.slack > 0:
            candidates = self._front = _undominated([*self._front, found], self.makespan_limit)
        before = self.best
        for candidate in candidates:
            if self.best is None or self._is_better(candidate.evaluation, self.best.evaluation):
                self.best = replace(candidate, time_s=found.time_s, lower_bound=found.lower_bound)
        if self.best is not None and self.best is not before:
            self._report(self.best)
            self._is_proven = self._is_met(self)
        return evaluation

    def _report(self, best: Improvement) -> None:
        self.trace.append(best.figures)
        if self._on_improvement is not None:
            self._callback_failed = True
            self._on_improvement(best)
            self._callback_failed = False

    @contextmanager
    def improving(self, stage: str) -> Iterator[None]:
        """Catch and log exceptions of the block, and add a note for the user.

        For optional stages after a plan has been found. If there is no plan, or `on_improvement` raised the exception,
        it propagates.

        Parameters
        ----------
        stage : str
            Name of the block in the note and the log.
        """
        try:
            yield
        except Exception as error:
            if self.best is None or self._callback_failed:
                raise
            _log.exception("%s failed", stage)
            self.notes.append(f"{stage} failed ({type(error).__name__}: {error}); {STANDS}")

    def _is_better(self, one: Evaluation, other: Evaluation) -> bool:
        """Return whether `one` is better; if energy counts, makespans up to the limit are equal."""
        if self.objective is Objective.MAKESPAN or one.unserved_rank != other.unserved_rank:
            return one.is_better_than(other, self.objective)
        limit = last_equal(self.makespan_limit)
        in_time = [score.served_makespan <= limit for score in (one, other)]
        if not all(in_time):
            return in_time[0] or (not any(in_time) and one.is_better_than(other, self.objective))
        return other.cost - one.cost > RELATIVE_TOLERANCE * other.cost

    def raise_bound(self, hours: float) -> None:
        """Record a proven lower bound on the makespan, in hours."""
        self.lower_bound = max(self.lower_bound, hours)

    @property
    def gap(self) -> float:
        """Relative gap (T - bound) / T of `fastest`; 1 while no allocation serves all tasks."""
        makespan = None if self.fastest is None else self.fastest.evaluation.makespan
        return 1.0 if makespan is None else relative_gap(makespan, self.lower_bound)

    @property
    def fast_enough(self) -> bool:
        """Whether the makespan of `fastest` is proven to be minimal, or within the given makespan limit."""
        if self.fastest is None or self.fastest.evaluation.makespan is None:
            return False
        given = self.tolerance.limit
        return self.gap <= PROVEN or (given is not None and self.fastest.evaluation.makespan <= given)

    def stop_reason(self) -> StopReason | None:
        """Return why the run should end now, or None if it should continue."""
        if self.interrupted:
            return StopReason.INTERRUPTED
        if self.remaining_s <= 0:
            return StopReason.TIME_LIMIT
        if self.budget.iterations is not None and self.iteration >= self.budget.iterations:
            return StopReason.ITERATIONS
        if self.budget.target_gap is not None and self.gap <= self.budget.target_gap:
            return StopReason.TARGET_GAP
        if self._is_proven:
            return StopReason.PROVEN
        if self.best is not None and self.fast_enough:
            energy_counts = self.objective is Objective.MAKESPAN_ENERGY
            if not energy_counts or self.best.evaluation.cost == 0:
                return StopReason.PROVEN
        return None

    def should_stop(self) -> bool:
        """Return whether the run should end now."""
        return self.stop_reason() is not None


def _undominated(found: list[Improvement], limit: float) -> list[Improvement]:
    """Return those within `limit` hours that have less energy than all faster ones, fastest first."""
    kept: list[Improvement] = []
    fewest = min(one.evaluation.unserved_rank for one in found)
    for one in sorted(found, key=lambda one: (one.evaluation.served_makespan, one.evaluation.cost)):
        score = one.evaluation
        in_time = score.served_makespan <= last_equal(limit)
        if in_time and score.unserved_rank == fewest and (not kept or score.cost < kept[-1].evaluation.cost):
            kept.append(one)
    return kept
