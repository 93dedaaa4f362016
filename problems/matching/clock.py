"""Time limits of matchings, and estimates of their speed."""

import math
import time
from collections.abc import Callable

Clock = Callable[[], float]
"""A function that returns the seconds left."""

EVALUATED_PER_SECOND = 10_000_000
"""Minimum number of distances computed per second."""

SAMPLED_PER_SECOND = 1_000_000
"""Number of sampled pairs for which a maximum matching takes about a second."""

GATHERED_PER_SECOND = 1_000_000
"""Minimum number of pairs within reach that are collected per second."""

MATCHED_PER_SECOND = 4_000_000
"""Number of pairs for which a maximum matching usually takes at most a second."""


def unlimited() -> float:
    """Return ``inf``, no time limit."""
    return math.inf


def at_least(seconds: float, time_left: Clock) -> Clock:
    """Return a clock like `time_left`, but with at least `seconds` from now on."""
    end = time.monotonic() + seconds
    return lambda: max(time_left(), end - time.monotonic())


def share_of(share: float, time_left: Clock) -> Clock:
    """Return a clock with the given share of the time that is left now."""
    seconds = time_left()
    return time_left if seconds == math.inf else lambda: time_left() - (1 - share) * seconds
