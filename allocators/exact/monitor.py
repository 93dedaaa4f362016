"""Monitoring of a running solver by the calling thread: submits its plans, and stops it when the run is over."""

import threading
from collections import deque
from collections.abc import Callable
from typing import TypeVar

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.model import Model
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import IntArray

Outcome = TypeVar("Outcome")


class SolverMonitor:
    """Submits the plans that a solver reports, and checks when it must stop.

    Parameters
    ----------
    search : Search
    model : Model
    demand : Demand
        The constraints to which the counts given to `report` belong.
    until_s : float
        Seconds since the run began at which the solver must end.
    meanwhile : callable, optional
        Work for the calling thread at every poll of the solver, for at most 50 ms; returns whether the solver is no
        longer needed.
    """

    def __init__(
        self,
        search: Search,
        model: Model,
        demand: Demand,
        until_s: float,
        meanwhile: Callable[[], bool] = lambda: False,
    ) -> None:
        self._search, self._model, self._demand, self._until_s = search, model, demand, until_s
        self._meanwhile = meanwhile
        self._reported: deque[IntArray] = deque(maxlen=1)
        self._error: BaseException | None = None
        self.stopped = threading.Event()

    def report(self, counts: IntArray) -> None:
        """Report a plan, from any thread."""
        self._reported.append(counts)

    def run(self, work: Callable[[], Outcome], stop: Callable[[], None]) -> Outcome | None:
        """Run `work` in its own thread until it ends; call `stop` when time is up or the run must end.

        Returns
        -------
        object or None
            The value returned by `work`; None if it did not end soon after `stop`.
        """

        def stop_all() -> None:
            self.stopped.set()
            stop()

        outcome = run_native(work, self._should_stop, stop_all)
        self._submit()
        if self._error is not None:
            raise self._error
        return outcome

    def _should_stop(self) -> bool:
        self._submit()
        over = self._error is not None or is_over(self._search) or self._search.elapsed_s >= self._until_s
        return over or self._meanwhile()

    def _submit(self) -> None:
        """Submit the last reported plan; an exception of the user's callback is raised after the solver has ended."""
        try:
            while self._reported and self._error is None:
                self._search.submit(self._model.allocation(self._demand, self._reported.popleft()))
        except BaseException as error:
            self._error = error


def is_over(search: Search) -> bool:
    """Whether the run must end; a makespan proven to 1e-6 is no reason, as exact methods continue to a full proof."""
    return search.stop_reason() not in (None, StopReason.PROVEN)
