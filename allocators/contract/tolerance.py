"""What counts as equally fast, and as proven."""

import sys
from dataclasses import dataclass

from alloc.problems.arguments import real

PROVEN = 1e-6
"""Relative gap at which a stage of the objective counts as proven."""


@dataclass(frozen=True)
class MakespanTolerance:
    """How slow an allocation may be before its makespan counts against it; for the objective with energy.

    Attributes
    ----------
    slack : float
        Relative excess over the fastest allocation found, >= 0; 0.02 takes any that is at most 2 % slower.
    limit : float or None
        Hours, > 0; allocations that are no slower are equally fast.
    """

    slack: float = 0.0
    limit: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "slack", real(self.slack, "slack"))
        if self.limit is not None:
            object.__setattr__(self, "limit", real(self.limit, "limit", above=True))

    def hours(self, fastest: float) -> float:
        """Return the makespan up to which allocations are equally fast, where the fastest takes `fastest` hours."""
        return min(max((1 + self.slack) * fastest, self.limit or 0.0), sys.float_info.max)


EXACT = MakespanTolerance()
"""No slack: the least makespan, whatever energy it takes."""


def relative_gap(value: float, bound: float) -> float:
    """Return (value - bound) / value, 0 where the two agree or value is 0."""
    return 0.0 if value <= 0 else max(0.0, (value - bound) / value)
