"""Progress within a part of a search's budget."""

import math

from alloc.allocators.contract.search import Search

LONG_S, LONG_ITERATIONS = 5.0, 1000
"""Seconds and iterations above which a budget counts as long."""


class Clock:
    """A part of a search's budget that begins now, in time and iterations; it ends when either is used up.

    Parameters
    ----------
    search : Search
    until_s : float
        Value of `Search.elapsed_s` at which the part ends.
    until_iteration : float
        Value of `Search.iteration` at which the part ends.
    """

    def __init__(self, search: Search, until_s: float = math.inf, until_iteration: float = math.inf) -> None:
        budget = search.budget
        self.search = search
        self.until_s = min(until_s, math.inf if budget.time_limit_s is None else budget.time_limit_s)
        self.until_iteration = min(until_iteration, math.inf if budget.iterations is None else budget.iterations)
        self.begin_s, self.begin_iteration = search.elapsed_s, search.iteration

    def part(self, share: float) -> "Clock":
        """Return a clock for the first `share` of the remaining budget."""
        search = self.search
        seconds = search.elapsed_s + share * (self.until_s - search.elapsed_s)
        iterations = (
            search.iteration + math.ceil(share * (self.until_iteration - search.iteration))
            if self.until_iteration < math.inf
            else math.inf
        )
        return Clock(search, seconds, iterations)

    @property
    def is_endless(self) -> bool:
        """Whether only a stop request ends this part."""
        return min(self.until_s, self.until_iteration) == math.inf

    @property
    def is_long(self) -> bool:
        """Whether there is time for a short annealing cycle before the main one."""
        search = self.search
        return self.until_s - search.elapsed_s > LONG_S and self.until_iteration - search.iteration > LONG_ITERATIONS

    @property
    def progress(self) -> float:
        """Used share of this part, from 0 to 1."""
        search = self.search
        seconds = (search.elapsed_s - self.begin_s) / max(1e-9, self.until_s - self.begin_s)
        iterations = (search.iteration - self.begin_iteration) / max(1, self.until_iteration - self.begin_iteration)
        return min(1.0, max(seconds, iterations))

    @property
    def iterations_left(self) -> float:
        """Number of iterations left, at the pace so far."""
        search = self.search
        pace_s = (search.elapsed_s - self.begin_s) / max(1, search.iteration - self.begin_iteration)
        in_time = (self.until_s - search.elapsed_s) / max(pace_s, 1e-9) if self.until_s < math.inf else math.inf
        return max(0.0, min(in_time, self.until_iteration - search.iteration))

    def iterations_of(self, number: int, count: int) -> float:
        """Return the remaining iterations of thread `number` out of `count`; ``inf`` if they are not limited."""
        left = self.until_iteration - self.search.iteration
        return left if left == math.inf else (left + count - 1 - number) // count

    @property
    def is_over(self) -> bool:
        """Whether this part has ended, or the search should stop."""
        search = self.search
        return search.elapsed_s >= self.until_s or search.iteration >= self.until_iteration or search.should_stop()
