"""Decomposition of an instance in which not every task can be served into the competing tasks and the rest."""

import sys

from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN, MakespanTolerance, relative_gap
from alloc.allocators.request import Request
from alloc.problems import Allocation, Objective, Shortage, only_allowed
from alloc.problems.text import labelled


class Decomposition:
    """A run on an instance in which not every task can be served.

    The competing tasks, for which there are too few agents, are allocated by matching: first for the least makespan,
    and at the end for the least energy within the makespan of the rest. The method allocates the rest, in which every
    task can be served.

    Parameters
    ----------
    whole : Search
        The run on the whole instance. Every allocation is submitted to it, beginning with the start of the request.
    shortage : Shortage
        The competing tasks and the rest.
    request : Request

    Attributes
    ----------
    shortage : Shortage
    rest : Search or None
        The run of the method on the rest; None if the rest has no tasks.
    """

    def __init__(self, whole: Search, shortage: Shortage, request: Request) -> None:
        self._whole, self.shortage = whole, shortage
        self.rest: Search | None = None
        start = request.start
        if start is not None:
            whole.submit(only_allowed(whole.instance, start))
        instance, tolerance = shortage.rest, request.tolerance
        self._hours = max(tolerance.hours(shortage.hours), sys.float_info.min)
        if instance is None:
            whole.submit(self._merged(None, self._hours))
            return
        self.rest = Search(
            instance,
            request.objective,
            request.budget,
            seed=request.seed,
            start=None if start is None else shortage.part_of(start),
            threads=request.threads,
            # the rest need not be faster than the competing tasks
            tolerance=MakespanTolerance(tolerance.slack, self._hours),
            on_improvement=lambda found: self._submit(found.allocation),
            stop=request.stop,
            spent_s=whole.elapsed_s,
        )

    def _submit(self, rest: Allocation) -> None:
        self._whole.submit(self.shortage.merged(rest))

    def conclude(self) -> None:
        """Submit the best allocation of the rest, with the cheapest one of the competing tasks that is as fast."""
        if self.rest is not None and self.rest.best is not None:
            self._whole.submit(self._merged(self.rest.best.allocation, self.rest.makespan_limit))

    def _merged(self, rest: Allocation | None, hours: float) -> Allocation:
        shortage = self.shortage
        if self._whole.objective is Objective.MAKESPAN_ENERGY:
            shortage = shortage.economical(hours, lambda: 0.0 if self._whole.interrupted else self._whole.remaining_s)
        return shortage.merged(rest)

    def notes(self) -> list[str]:
        """Return the notes on the rest, and on the makespan bound for the tasks that are served."""
        best, bound = self._whole.best, self.shortage.bound
        notes: list[str] = []
        if self.rest is not None:
            bound, notes = max(bound, self.rest.lower_bound), self.rest.notes
        if best is None or bound <= 0:
            return notes
        hours, unit = best.evaluation.served_makespan, self._whole.instance.units.time
        taken, least = labelled(f"{hours:.6g}", unit), labelled(f"{bound:.6g}", unit)
        as_much = "as many tasks" if self.shortage.precedence is None else "as many and as urgent tasks"
        if relative_gap(hours, bound) <= PROVEN:
            return [*notes, f"no plan that serves {as_much} has a shorter makespan than this one, {taken}"]
        return [*notes, f"every plan that serves {as_much} takes at least {least}, this one {taken}"]
