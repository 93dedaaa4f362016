"""Tolerances: which makespans count as equal, and which gaps as closed."""

import sys
from dataclasses import dataclass

from alloc.problems.arguments import real

PROVEN = 1e-6
"""Relative gap at which a stage of the objective counts as proven."""


@dataclass(frozen=True)
class MakespanTolerance:
    """Range of makespans that count as equally good; for objectives with energy.

    Attributes
    ----------
    slack : float
        Relative excess over the fastest allocation found, >= 0; with 0.02, allocations may be up to 2 % slower.
    limit : float or None
        Makespan in hours, > 0, up to which all allocations count as equally fast.
    """

    slack: float = 0.0
    limit: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "slack", real(self.slack, "slack"))
        if self.limit is not None:
            object.__setattr__(self, "limit", real(self.limit, "limit", above=True))

    def hours(self, fastest: float) -> float:
        """Return the makespan up to which allocations count as equally fast, given the least makespan in hours."""
        return min(max((1 + self.slack) * fastest, self.limit or 0.0), sys.float_info.max)


EXACT = MakespanTolerance()
"""No slack: the least makespan, regardless of energy."""


def relative_gap(value: float, bound: float) -> float:
    """Return (value - bound) / value, or 0 if that is negative or `value` is 0."""
    return 0.0 if value <= 0 else max(0.0, (value - bound) / value)
