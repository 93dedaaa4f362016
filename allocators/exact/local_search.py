"""Local search within a run of an exact method, alternating with other phases or in parallel in its own thread."""

from collections import deque
from concurrent.futures import Future
from types import TracebackType

import numpy as np

from alloc.allocators.contract.clock import Clock
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import MakespanTolerance
from alloc.allocators.exact.solver_model import is_repeatable
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.improve import MakespanReduction, improve
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.allocators.heuristic.local_search.parts import Team
from alloc.allocators.parallel.pool import Pool
from alloc.problems import Allocation, Objective

REPEATABLE_ITERATIONS = 50
"""Iterations of a turn in repeatable runs."""


class LocalSearchPhase:
    """Improves the plan of a run by local search; to be used in a `with` statement.

    Parameters
    ----------
    search : Search
        The run, which must have a plan.
    objective : Objective
        The makespan only, or the energy within `limit`.
    until_s : float
        Seconds since the run began at which the phase must end.
    limit : float, optional
        Makespan in hours up to which the energy is minimised.
    """

    def __init__(self, search: Search, objective: Objective, until_s: float, limit: float | None = None) -> None:
        self._search, self._until_s = search, until_s
        self._found: deque[Allocation] = deque()
        self._part = search.part(
            objective, MakespanTolerance(limit=limit), lambda found: self._found.append(found.allocation)
        )
        self._pool = Pool(1) if search.threads > 1 and not is_repeatable(search) else None
        self._running: Future[None] | None = None
        self._reduction: MakespanReduction | None = None

    def __enter__(self) -> "LocalSearchPhase":
        if self._pool is not None:
            self._running = self._pool.submit(improve, self._part, until_s=self._until_s)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._pool is not None:
            self._part.end()
            self._pool.shutdown()
        if error is None:
            self.exchange()
            if self._running is not None:
                self._running.result()

    @property
    def is_beside(self) -> bool:
        """Whether it runs in its own thread and needs no turns."""
        return self._pool is not None

    def turn(self, seconds: float) -> None:
        """Improve the plan for `seconds`, unless another thread does so anyway, and submit improvements."""
        if not self.is_beside:
            for known in (self._search.fastest, self._search.best):
                if known is not None:
                    self._part.submit(known.allocation)
            if is_repeatable(self._search):
                self._improve(np.inf, REPEATABLE_ITERATIONS)
            else:
                self._improve(min(self._until_s, self._part.elapsed_s + seconds), np.inf)
        self.exchange()

    def _improve(self, until_s: float, iterations: float) -> None:
        """Improve the plan; for the makespan, resume from the last turn unless there is a better plan."""
        part = self._part
        if part.objective is not Objective.MAKESPAN:
            improve(part, until_s=until_s, iterations=iterations)
            return
        if self._reduction is None:
            parameters = LocalSearchParameters()
            state = AnnealingState(part.instance, part.seed, parameters.neighbours)
            self._reduction = MakespanReduction(part, Team([state], map), parameters)
        self._reduction.run(Clock(part, until_s, part.iteration + iterations))

    def exchange(self) -> None:
        """Submit improvements to the run, and pass its bound on to the local search."""
        while self._found:
            self._search.submit(self._found.popleft())
        self._part.raise_bound(self._search.lower_bound)
