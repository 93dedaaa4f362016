"""Reduce the makespan by attempts at one target makespan after the other; can be interrupted, and goes on."""

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.clock import Clock
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.problems import Allocation
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import FloatArray

LEAST_SHARE = 0.2
"""Share of the time for the makespan in which it is not given up."""


class MakespanReduction:
    """Attempts at target makespans between the lower bound and the best plan, closer to the best after each failure.

    Parameters
    ----------
    search : Search
        It has a plan.
    state : AnnealingState
    parameters : LocalSearchParameters
    """

    def __init__(self, search: Search, state: AnnealingState, parameters: LocalSearchParameters) -> None:
        self._search, self._state, self._parameters = search, state, parameters
        self._iterations, self._fraction, self._attempts = float(parameters.attempt_iterations), 0.0, 0
        self._known: Allocation | None = None

    def run(self, clock: Clock, *, patience: float | None = None) -> None:
        """Go on until the clock ends, from where the last run ended or from a better plan found elsewhere.

        With `patience`, ends early when the last improvement was that many times as long ago as it took, but not in the
        first `LEAST_SHARE` of the clock.
        """
        search, parameters, improved = self._search, self._parameters, 0.0
        assert search.fastest is not None
        if search.fastest.allocation is not self._known:
            self._state.begin(search.fastest.allocation, search.fastest.evaluation.served_makespan)
            self._iterations, self._fraction = float(parameters.attempt_iterations), 0.0
        while not clock.is_over and not search.fast_enough:
            fastest = search.fastest.evaluation
            best = fastest.served_makespan
            bound = min(search.lower_bound, best) if fastest.makespan is not None else 0.5 * best
            if bound >= best * (1 - RELATIVE_TOLERANCE):
                return
            if patience is not None and clock.progress > max(LEAST_SHARE, (1 + patience) * improved):
                return
            reached = self._attempt(clock, bound + self._fraction * (best - bound), self._noise())
            self._fraction = 0.5 * self._fraction if reached else min(0.5 * (1 + self._fraction), 0.999)
            self._iterations *= 1.0 if reached else parameters.attempt_growth
            self._attempts += 1
            if search.fastest.evaluation.served_makespan < best:
                improved = clock.progress
        self._known = search.fastest.allocation

    def _noise(self) -> FloatArray:
        """Return the noise of each iteration of the next attempt."""
        noises, last = self._parameters.attempt_noise, self._parameters.attempt_final_noise
        initial = noises[self._attempts % len(noises)]
        return self._state.mean_ability * np.geomspace(initial, last, int(self._iterations) + 1)[1:]

    def _attempt(self, clock: Clock, makespan: float, noise: FloatArray) -> bool:
        """Look for a plan within a target makespan, with the noise of each iteration; return whether one was found."""
        search, state = self._search, self._state
        assert search.fastest is not None
        state.set_target(makespan)
        for level in noise.tolist():
            if clock.is_over or not state.n_short:
                break
            state.run(self._parameters.exchanges, state.weights(0.0, level, 0.0, 1.0))
            search.iteration += 1
        fastest = search.fastest.evaluation.served_makespan
        # where travel takes time, only the evaluation knows the makespan
        if not state.n_short or not state.arrays.instant_travel or state.current_makespan < fastest:
            search.submit(state.allocation)
        return not state.n_short
