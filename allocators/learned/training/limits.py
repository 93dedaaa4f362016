"""Limits of a training run, and its progress."""

from collections.abc import Sequence
from dataclasses import dataclass

from alloc.allocators.learned.training.report import Report, best_generation
from alloc.problems.arguments import real, whole


@dataclass(frozen=True)
class Limits:
    """Limits of a training run, which ends at the first one reached; all count from the beginning of the run.

    Attributes
    ----------
    steps : int or None
        Decisions of agents, summed over all members, >= 0.
    iterations : int or None
        Generations, >= 0.
    minutes : float or None
        Training time, finite and >= 0.
    patience : int or None
        Consecutive generations without better networks.
    """

    steps: int | None = None
    iterations: int | None = None
    minutes: float | None = None
    patience: int | None = None

    def __post_init__(self) -> None:
        for name, check in (("steps", whole), ("iterations", whole), ("minutes", real), ("patience", whole)):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, check(value, name))

    def progress(self, history: Sequence[Report]) -> float:
        """Return the progress of the training, 0 to 1: by steps, or else generations, or else time."""
        decisions, seconds = _spent(history)
        for limit, done in (
            (self.steps, decisions),
            (self.iterations, len(history)),
            (self.minutes and 60 * self.minutes, seconds),
        ):
            if limit is not None:
                return min(1.0, done / limit) if limit > 0 else 1.0
        return 0.0

    def reached(self, history: Sequence[Report]) -> bool:
        """Return whether a limit is reached."""
        decisions, seconds = _spent(history)
        return (
            (self.steps is not None and decisions >= self.steps)
            or (self.iterations is not None and len(history) >= self.iterations)
            or (self.minutes is not None and seconds >= 60 * self.minutes)
            or (self.patience is not None and len(history) - best_generation(history) >= max(1, self.patience))
        )


def _spent(history: Sequence[Report]) -> tuple[int, float]:
    """Return the decisions and the seconds of a run so far."""
    return (history[-1].decisions, history[-1].seconds) if history else (0, 0.0)
