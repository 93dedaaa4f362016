"""How much time matchings have, and how much they get done in it."""

import math
import time
from collections.abc import Callable

Clock = Callable[[], float]
"""Seconds that are left."""

EVALUATED_PER_SECOND = 10_000_000
"""Distances that are worked out in a second, at the least."""

SAMPLED_PER_SECOND = 1_000_000
"""Pairs of a sample for which a largest matching takes about a second."""

GATHERED_PER_SECOND = 1_000_000
"""Pairs within reach that are gathered in a second, at the least."""

MATCHED_PER_SECOND = 4_000_000
"""Pairs for which a largest matching takes a second, at the most, as a rule."""


def unlimited() -> float:
    """Return ``inf``: no limit of time."""
    return math.inf


def at_least(seconds: float, time_left: Clock) -> Clock:
    """Return a clock that shows what `time_left` does, but that has so many seconds from now on in any case."""
    end = time.monotonic() + seconds
    return lambda: max(time_left(), end - time.monotonic())


def share_of(share: float, time_left: Clock) -> Clock:
    """Return a clock that runs out when this share of the time that is left now has passed."""
    seconds = time_left()
    return time_left if seconds == math.inf else lambda: time_left() - (1 - share) * seconds
