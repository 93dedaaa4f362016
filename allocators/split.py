"""The part of an instance that a method is asked for: all of it, where every task can be served."""

import sys
import threading

from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN, MakespanTolerance, relative_gap
from alloc.problems import Allocation, Objective, Shortage, only_allowed


class Split:
    """A run on an instance in which not every task can be served.

    Who serves which of the competing tasks is settled beforehand, at the least makespan, and again at the end, at the
    least energy in the time that the rest takes; a method allocates the rest, where every task can be served.

    Parameters
    ----------
    whole : Search
        The run; it gets every allocation of the whole instance, `start` first of all.
    shortage : Shortage
    start : Allocation or None
        A warm start.
    stop : threading.Event
        What ends the run.

    Attributes
    ----------
    shortage : Shortage
    search : Search or None
        The run on the rest, for the method; None where nothing is left for it.
    """

    def __init__(self, whole: Search, shortage: Shortage, start: Allocation | None, stop: threading.Event) -> None:
        self._whole, self.shortage = whole, shortage
        self.search: Search | None = None
        if start is not None:
            whole.submit(only_allowed(whole.instance, start))
        rest, tolerance = shortage.rest, whole.tolerance
        self._hours = max(tolerance.hours(shortage.hours), sys.float_info.min)
        if rest is None:
            whole.submit(self._merged(None, self._hours))
            return
        self.search = Search(
            rest,
            whole.objective,
            whole.budget,
            seed=whole.seed,
            start=None if start is None else shortage.part_of(start),
            threads=whole.threads,
            tolerance=MakespanTolerance(
                tolerance.slack, self._hours
            ),  # the rest need not be faster than the competing tasks
            on_improvement=lambda found: self._tell(found.allocation),
            stop=stop,
            spent_s=whole.elapsed_s,
        )

    def _tell(self, rest: Allocation) -> None:
        self._whole.submit(self.shortage.merged(rest))

    def conclude(self) -> None:
        """Submit the best of the rest beside the cheapest allocation of the competing tasks that is as fast."""
        if self.search is not None and self.search.best is not None:
            self._whole.submit(self._merged(self.search.best.allocation, self.search.makespan_limit))

    def _merged(self, rest: Allocation | None, hours: float) -> Allocation:
        shortage = self.shortage
        if self._whole.objective is Objective.MAKESPAN_ENERGY:
            shortage = shortage.economical(hours, lambda: 0.0 if self._whole.interrupted else self._whole.remaining_s)
        return shortage.merged(rest)

    def notes(self) -> list[str]:
        """Say what went wrong with the rest, and what is proven of the makespan of the tasks that are served."""
        best, bound = self._whole.best, self.shortage.bound
        told: list[str] = []
        if self.search is not None:
            bound, told = max(bound, self.search.lower_bound), self.search.notes
        if best is None or bound <= 0:
            return told
        hours = best.evaluation.served_makespan
        if relative_gap(hours, bound) <= PROVEN:
            return [*told, f"no plan that serves as many tasks is done sooner than in these {hours:.6g} h"]
        return [*told, f"every plan that serves as many tasks takes {bound:.6g} h or more, this one {hours:.6g} h"]
