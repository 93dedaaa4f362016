"""The budget of a run: how long it may take, and why it ended."""

from dataclasses import dataclass
from enum import StrEnum

from alloc.problems.arguments import real, whole


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
        for name, check in (("time_limit_s", real), ("iterations", whole), ("target_gap", real)):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, check(value, name))


class StopReason(StrEnum):
    """Why a run ended."""

    PROVEN = "proven"
    FINISHED = "finished"
    TIME_LIMIT = "time_limit"
    ITERATIONS = "iterations"
    TARGET_GAP = "target_gap"
    INTERRUPTED = "interrupted"
