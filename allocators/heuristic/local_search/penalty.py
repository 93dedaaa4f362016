"""Strategic oscillation: how much shortfalls count rises where plans stay short, and falls where none is.

Where the makespan leaves much room, a low penalty lets shortfalls pass from task to task for less energy. At the very
least makespan few plans have none, and a search that has lost them seldom finds another: it returns to the best one.
"""

import math

from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState

RISE, FALL = 1.2, 0.9
"""Factors by which the penalty changes after a period that ends with a shortfall, and without one."""

LOWEST, HIGHEST = 0.1, 100.0
"""Limits of the factor; 1 to begin with."""

EXCHANGES_PER_AGENT = 5.0
"""Length of a period."""

LEAST_EXCHANGES = 250.0
"""Exchanges per agent that the budget must allow, for it takes many periods."""

PATIENCE = 3
"""Periods in a row that end with a shortfall, after one more of which the search returns to the best plan."""


class PenaltyFactor:
    """The factor on the penalties of shortfalls, and the returns to the best plan.

    Parameters
    ----------
    state : AnnealingState
    exchanges : int
        Exchanges in an iteration.
    allowed : float
        Exchanges per agent that the budget allows.

    Attributes
    ----------
    value : float
    """

    def __init__(self, state: AnnealingState, exchanges: int, allowed: float) -> None:
        self.value, self._state = 1.0, state
        self._period = EXCHANGES_PER_AGENT * state.instance.n / exchanges if allowed >= LEAST_EXCHANGES else math.inf
        self._iterations, self._short_periods = 0, 0

    def update(self) -> None:
        """Take note of an iteration."""
        self._iterations += 1
        if self._iterations < self._period:
            return
        self._iterations = 0
        is_short = self._state.n_short > 0
        self.value = min(HIGHEST, max(LOWEST, self.value * (RISE if is_short else FALL)))
        self._short_periods = self._short_periods + 1 if is_short else 0
        if self._short_periods > PATIENCE:
            self._state.return_to_best()
            self._short_periods = 0
