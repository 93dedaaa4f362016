"""Adaptive numbers of rounds per time slice."""

import time
from collections.abc import Callable

import numpy as np

SLICE_S = 0.01
"""Time slice of each side in one call of `PrimalDual.run`, in seconds."""


class Timer:
    """Adapts the number of rounds to a time slice by the duration of the last ones.

    Attributes
    ----------
    spent_s : float
        Total time of all rounds so far.
    """

    def __init__(self) -> None:
        self._rounds, self.spent_s = 1, 0.0

    def run(self, work: Callable[[int], None]) -> None:
        """Run as many rounds as fit into a time slice."""
        begin = time.monotonic()
        work(self._rounds)
        took = max(time.monotonic() - begin, 1e-5)
        self.spent_s += took
        self._rounds = int(np.clip(self._rounds * np.clip(SLICE_S / took, 0.25, 2.0), 1, 100_000))
