"""One run of one method on one instance: clock, budget, best allocation so far, stop requests."""

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
"""End of the note on a stage that failed after a plan had been found."""

_log = logging.getLogger("alloc")


class Search:
    """The run as a method sees it; made by `solve`.

    Parameters
    ----------
    instance, objective, budget, seed, start, threads, tolerance
        As the attributes below.
    on_improvement : callable, optional
        Called with every new best.
    stop : threading.Event, optional
        Setting it ends the run.
    spent_s : float
        Seconds that count for the run although they have passed already.

    Attributes
    ----------
    instance : Instance
    objective : Objective
    budget : Budget
    seed : int
    start : Allocation or None
        A warm start, already submitted; agents assigned to tasks that they cannot do are idle in it.
    threads : int
        Threads that the method may use.
    lower_bound : float
        Best lower bound known on the makespan of allocations that serve all tasks, in hours.
    best : Improvement or None
        The best submitted so far.
    fastest : Improvement or None
        The one with the least makespan among those that leave the fewest and least urgent tasks unserved; differs from
        `best` only where energy counts.
    tolerance : MakespanTolerance
        How much slower than the fastest the best may be.
    iteration : int
        Iterations done, counted by the method in its own unit.
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
        self._front: list[Improvement] = []  # candidates for `best` once the fastest becomes faster
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
        """Seconds until the time limit, never negative; ``inf`` without one."""
        limit = self.budget.time_limit_s
        return float("inf") if limit is None else max(0.0, limit - self.elapsed_s)

    @property
    def interrupted(self) -> bool:
        """Whether a stop was requested, by a signal or the `stop` event."""
        return self._is_ended or self._stop.is_set()

    @property
    def makespan_limit(self) -> float:
        """Hours up to which allocations count as equally fast, so that energy decides; ``inf`` before the first one."""
        return math.inf if self.fastest is None else self.tolerance.hours(self.fastest.evaluation.served_makespan)

    def part(
        self,
        objective: Objective,
        tolerance: MakespanTolerance,
        on_improvement: Callable[[Improvement], None] | None = None,
        budget: Budget | None = None,
    ) -> "Search":
        """Return a run of its own on the same instance, with the same clock, stop event and best plans.

        For another method within this run, possibly in another thread.

        Parameters
        ----------
        objective, tolerance, on_improvement
            As those of a search; improvements are not submitted to this one.
        budget : Budget, optional
            Its time limit is on the clock of this run; by default the time limit of this run, and no other limit.
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
        """End this run, from any thread, but not the one that it is a part of."""
        self._is_ended = True

    def end_when(self, is_met: Callable[["Search"], bool]) -> None:
        """End this run as soon as its best plan is proven best: `is_met` is asked now, and of every new best."""
        self._is_met = is_met
        self._is_proven = is_met(self)

    def submit(self, allocation: Allocation) -> Evaluation:
        """Score `allocation`, and keep and report it if it is the best so far.

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
        """Let an exception in the block end only the block: it is logged, and a note tells the user.

        For optional stages after a plan has been found; without a plan the exception propagates, as does any that
        `on_improvement` raises.

        Parameters
        ----------
        stage : str
            What the note and the log call the block.
        """
        try:
            yield
        except Exception as error:
            if self.best is None or self._callback_failed:
                raise
            _log.exception("%s failed", stage)
            self.notes.append(f"{stage} failed ({type(error).__name__}: {error}); {STANDS}")

    def _is_better(self, one: Evaluation, other: Evaluation) -> bool:
        """Whether `one` is better, where makespans up to the limit are equal if energy counts."""
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
        """Relative gap (T - bound) / T of the fastest so far; 1 if nothing serves all tasks yet."""
        makespan = None if self.fastest is None else self.fastest.evaluation.makespan
        return 1.0 if makespan is None else relative_gap(makespan, self.lower_bound)

    @property
    def fast_enough(self) -> bool:
        """Whether the fastest so far is proven to be fastest, or keeps to the makespan limit that was given."""
        if self.fastest is None or self.fastest.evaluation.makespan is None:
            return False
        given = self.tolerance.limit
        return self.gap <= PROVEN or (given is not None and self.fastest.evaluation.makespan <= given)

    def stop_reason(self) -> StopReason | None:
        """Return why the run should end now, or None if it should go on."""
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
        """Whether the run should end now."""
        return self.stop_reason() is not None


def _undominated(found: list[Improvement], limit: float) -> list[Improvement]:
    """Keep those within `limit` hours that have less energy than all faster ones, the fastest first."""
    kept: list[Improvement] = []
    fewest = min(one.evaluation.unserved_rank for one in found)
    for one in sorted(found, key=lambda one: (one.evaluation.served_makespan, one.evaluation.cost)):
        score = one.evaluation
        in_time = score.served_makespan <= last_equal(limit)
        if in_time and score.unserved_rank == fewest and (not kept or score.cost < kept[-1].evaluation.cost):
            kept.append(one)
    return kept
