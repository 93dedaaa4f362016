"""What the stages ask a solver, what it answers, and what goes on in the calling thread meanwhile."""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.model import Demand, Model
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True)
class Test:
    """A makespan to be tried, the seconds that it may take, and whether nothing is lost or left if they pass in vain.

    A test at the `top`, just below the best plan, comes early, to see whether the plan is the optimum already; the
    `last` one comes when bisection has met nothing but open tests.
    """

    time: float
    seconds: float
    top: bool = False
    last: bool = False


@dataclass(frozen=True, eq=False)
class Question:
    """Whether there is a plan with this demand, and which costs least.

    Attributes
    ----------
    demand : Demand
    cost : ndarray, shape (p,), or None
        Cost >= 0 of one agent of each pair, to be minimised; None if any plan will do.
    hint : ndarray of int, shape (p,), or None
        Agents per pair of a plan to begin with.
    seconds : float
        Time limit, possibly ``inf``.
    threads : int
    seed : int
    repeatable : bool
        Whether effort is to be limited by counting work, so that the same seed gives the same answer.
    """

    demand: Demand
    cost: FloatArray | None
    hint: IntArray | None
    seconds: float
    threads: int
    seed: int
    repeatable: bool


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver found out.

    Attributes
    ----------
    counts : ndarray of int, shape (p,), or None
        Agents per pair of the best plan; the evaluator has the last word on it.
    impossible : bool
        Whether there is proven to be no plan.
    bound : float
        No plan costs less.
    """

    counts: IntArray | None = None
    impossible: bool = False
    bound: float = 0.0


UNKNOWN = Answer()


class Watch:
    """Keeps the calling thread at work while a solver runs: it submits what the solver finds and sees when to halt.

    Parameters
    ----------
    search : Search
    model : Model
    demand : Demand
        What the counts given to `tell` are about.
    until_s : float
        Seconds since the run began at which the solver must end.
    meanwhile : callable, optional
        What the calling thread does each time that it looks at the solver, for 50 ms at most; returns whether the
        solver is no longer needed.
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
        self._finds: deque[IntArray] = deque(maxlen=1)
        self._error: BaseException | None = None
        self.halted = threading.Event()

    def tell(self, counts: IntArray) -> None:
        """Report a plan, from any thread."""
        self._finds.append(counts)

    def run(self, work: Callable[[], Answer], halt: Callable[[], None]) -> Answer:
        """Run `work` in its own thread until it ends, time is up or the run is stopped; UNKNOWN if it did not obey."""

        def halt_all() -> None:
            self.halted.set()
            halt()

        answer = run_native(work, self._should_stop, halt_all)
        self._submit()
        if self._error is not None:
            raise self._error
        return answer or UNKNOWN

    def _should_stop(self) -> bool:
        self._submit()
        over = self._error is not None or is_over(self._search) or self._search.elapsed_s >= self._until_s
        return over or self._meanwhile()

    def _submit(self) -> None:
        """Submit the last find; what a callback of the user raises waits until the solver has ended."""
        try:
            while self._finds and self._error is None:
                self._search.submit(self._model.allocation(self._demand, self._finds.popleft()))
        except BaseException as error:
            self._error = error


def is_over(search: Search) -> bool:
    """Whether the run must end; a makespan proven to 1e-6 alone is no reason, as exact methods go on to the end."""
    return search.stop_reason() not in (None, StopReason.PROVEN)
