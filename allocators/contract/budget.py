"""The budget of a run, and the reasons why a run ends."""

from dataclasses import dataclass
from enum import StrEnum

from alloc.problems.arguments import real, whole


@dataclass(frozen=True)
class Budget:
    """Limits of a run; every limit that is not None applies.

    Attributes
    ----------
    time_limit_s : float or None
        Seconds on the wall clock, >= 0.
    iterations : int or None
        Iterations in the method's own unit, >= 0; runs with only this limit are reproducible.
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
