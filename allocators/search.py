"""One run of one method on one instance: budget, clock, best so far, and the will to stop."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from alloc.problems import (
    Allocation,
    Evaluation,
    InputError,
    Instance,
    Objective,
    evaluate,
    makespan_lower_bound,
    serve_all,
)

PROVEN = 1e-6
"""Relative gap at which a stage of the objective counts as proven."""


@dataclass(frozen=True)
class Budget:
    """How long a run may take; every limit that is not None holds.

    Attributes
    ----------
    time_limit_s : float or None
        Seconds on the wall clock, >= 0.
    iterations : int or None
        Iterations in the method's own unit, >= 0; with this limit alone, runs are reproducible.
    target_gap : float or None
        Relative gap of the makespan, >= 0, at which the run may stop.
    """

    time_limit_s: float | None = 10.0
    iterations: int | None = None
    target_gap: float | None = None

    def __post_init__(self) -> None:
        for name in ("time_limit_s", "iterations", "target_gap"):
            value = getattr(self, name)
            if value is not None and not 0 <= value < math.inf:
                option = name.removesuffix("_s").replace("_", "-")
                raise InputError(f"must be a finite number >= 0, got {value}", option)


class StopReason(StrEnum):
    """Why a run ended."""

    PROVEN = "proven"
    FINISHED = "finished"
    TIME_LIMIT = "time_limit"
    ITERATIONS = "iterations"
    TARGET_GAP = "target_gap"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True)
class Improvement:
    """A new best allocation, as told to `on_improvement`.

    Attributes
    ----------
    time_s : float
        Seconds since the run began.
    allocation : Allocation
    evaluation : Evaluation
    lower_bound : float
        Best lower bound on the makespan at that moment, in hours.
    """

    time_s: float
    allocation: Allocation
    evaluation: Evaluation
    lower_bound: float


class Search:
    """What a method sees of its run; made by `solve`.

    Attributes
    ----------
    instance : Instance
    objective : Objective
    budget : Budget
    seed : int
    start : Allocation or None
        A warm start, already submitted; agents sent where they cannot go are idle in it.
    threads : int
        Threads that the method may use.
    lower_bound : float
        Best lower bound known on the makespan of allocations that serve all tasks, in hours.
    best : Improvement or None
        The best submitted so far.
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
        on_improvement: Callable[[Improvement], None] | None = None,
        stop: threading.Event | None = None,
    ) -> None:
        self._begin = time.monotonic()
        self.instance, self.objective, self.budget = instance, objective, budget
        self.seed, self.start, self.threads = seed, start, threads
        self._on_improvement, self._stop = on_improvement, stop or threading.Event()
        self.iteration = 0
        self.best: Improvement | None = None
        self.trace: list[Improvement] = []
        self.lower_bound = makespan_lower_bound(instance)
        if start is not None:
            evaluate(instance, start)  # says what is wrong with a start of another size
            self.start = serve_all(instance, start)  # agents that can no longer go where they were sent are idle
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
        """Whether somebody asked the run to end."""
        return self._stop.is_set()

    def submit(self, allocation: Allocation) -> Evaluation:
        """Score `allocation`, keep it if it is the best so far, and report that."""
        evaluation = evaluate(self.instance, allocation)
        if self.best is None or evaluation.is_better_than(self.best.evaluation, self.objective):
            self.best = Improvement(self.elapsed_s, allocation, evaluation, self.lower_bound)
            self.trace.append(self.best)
            if self._on_improvement is not None:
                self._on_improvement(self.best)
        return evaluation

    def raise_bound(self, hours: float) -> None:
        """Tell a proven lower bound on the makespan."""
        self.lower_bound = max(self.lower_bound, hours)

    @property
    def gap(self) -> float:
        """Relative gap (T - bound) / T of the best so far; 1 if nothing serves all tasks yet."""
        makespan = None if self.best is None else self.best.evaluation.makespan
        return 1.0 if makespan is None else relative_gap(makespan, self.lower_bound)

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
        if self.best is not None and self.gap <= PROVEN:
            energy_counts = self.objective is Objective.MAKESPAN_ENERGY
            if not energy_counts or self.best.evaluation.energy == 0:
                return StopReason.PROVEN
        return None

    def should_stop(self) -> bool:
        """Whether the run should end now."""
        return self.stop_reason() is not None


def relative_gap(value: float, bound: float) -> float:
    """Return (value - bound) / value, 0 where the two agree or value is 0."""
    return 0.0 if value <= 0 else max(0.0, (value - bound) / value)
