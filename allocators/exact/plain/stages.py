"""The least makespan, then the least energy at it, by the solver alone on the model of `problems.models`."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from alloc.allocators.contract.base import Proposal
from alloc.allocators.contract.search import Search
from alloc.allocators.exact.monitor import is_over
from alloc.allocators.exact.solver_model import SolverLimits
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems import Allocation, Instance, Objective
from alloc.problems.instance import IntArray
from alloc.problems.models.programme import Programme, build_programme

Report = Callable[[IntArray], None]
"""Callback that takes the pairs of a plan, by index."""


@dataclass(frozen=True, eq=False)
class PlainAnswer:
    """Answer of a solver to a programme.

    Attributes
    ----------
    pairs : ndarray of int or None
        Pairs of agent and task of the best plan, by index.
    bound : float or None
        Proven bound on the objective: the ratio BOUND / T from above, or the energy from below.
    """

    pairs: IntArray | None = None
    bound: float | None = None


class PlainSolver(Protocol):
    """A solver for one programme."""

    def __init__(self, programme: Programme, limits: SolverLimits) -> None: ...

    def solve(self, report: Report) -> PlainAnswer:
        """Solve the programme, and report every plan found."""
        ...

    def stop(self) -> None:
        """Request the solver to stop, from another thread."""
        ...


def refusal_of_plain(instance: Instance, max_pairs: int) -> str | None:
    """Return why the model cannot be stated, or None."""
    if instance.has_travel_time:
        return "the plain model does not support finite speeds"
    pairs = instance.n * int((instance.workload > 0).sum())
    return None if pairs <= max_pairs else f"it takes {max_pairs} pairs of agent and task, this has {pairs}"


def allocate_plain(search: Search, solver: type[PlainSolver]) -> Proposal:
    """Return the bounds that the solver proves; submit every plan that it finds."""
    instance = search.instance
    if not (instance.workload > 0).any():
        return Proposal(Allocation.idle(instance), energy_lower_bound=0.0)
    programme = build_programme(instance, by_class=False, objective=Objective.MAKESPAN)
    ratio = _solve(search, programme, solver).bound
    if ratio is not None:
        search.raise_bound(programme.hours / min(1.0, ratio))
    if search.objective is Objective.MAKESPAN or not search.fast_enough or is_over(search):
        return Proposal()
    programme = build_programme(
        instance, by_class=False, objective=Objective.MAKESPAN_ENERGY, makespan=search.makespan_limit
    )
    return Proposal(energy_lower_bound=_solve(search, programme, solver).bound)


def _solve(search: Search, programme: Programme, solver: type[PlainSolver]) -> PlainAnswer:
    """Run the solver in its own thread until it or the run ends; submit its plans."""
    reported: deque[IntArray] = deque(maxlen=1)
    seconds = search.remaining_s if search.budget.time_limit_s is not None else math.inf
    back_end = solver(programme, SolverLimits.of(search, seconds, search.threads))

    def submit() -> None:
        while reported:
            search.submit(_allocation(programme, reported.popleft()))

    def should_stop() -> bool:
        submit()
        return is_over(search)

    answer = run_native(lambda: back_end.solve(reported.append), should_stop, back_end.stop) or PlainAnswer()
    if answer.pairs is not None:
        reported.append(answer.pairs)
    submit()
    return answer


def _allocation(programme: Programme, pairs: IntArray) -> Allocation:
    task_of_agent = np.full(programme.instance.n, -1, dtype=np.intp)
    task_of_agent[programme.kind[pairs]] = programme.tasks[programme.row[pairs]]
    return Allocation(task_of_agent)
