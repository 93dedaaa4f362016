"""Bounds that `solve` itself proves by linear programmes, before and after the method runs."""

import sys
import time
from collections.abc import Callable

import numpy as np

from alloc.allocators.contract.base import Proposal
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.runtime.interrupts import run_native
from alloc.problems import Objective, agent_classes, count_classes, energy_lower_bound, lp_makespan_lower_bound
from alloc.problems.bounds import LP_PAIRS_PER_SECOND, LP_SIZE_LIMIT
from alloc.problems.distances.neighbours import estimated_pairs
from alloc.problems.distances.reach import Reach
from alloc.problems.matching.clock import GATHERED_PER_SECOND

SHORT_S = 0.1
"""Time limit in seconds up to which no linear programme is solved after the run: even small ones take milliseconds."""

UNLIMITED_S = 30.0
"""Seconds for the linear programme before a run without a time limit: enough for it to finish, for reproducibility."""


def raise_bound_before(search: Search) -> None:
    """Raise the makespan bound before the run, so that a target gap is measured against it."""
    seconds = UNLIMITED_S if search.budget.time_limit_s is None else seconds_for_bounds(search)
    raise_makespan_bound(search, time.monotonic() + seconds)


def raise_makespan_bound(search: Search, end: float) -> None:
    """Raise the makespan bound by linear programmes, until `end` on the monotonic clock."""
    seconds = max(0.0, end - time.monotonic())
    prove = _bound_below_plan if search.fastest is not None and search.gap < 1 else _bound_without_plan
    search.raise_bound(_unless_interrupted(search, lambda: prove(search, seconds)) or 0.0)


def _bound_without_plan(search: Search, seconds: float) -> float | None:
    """Return the bound from a single linear programme, for runs that have no plan yet."""
    return lp_makespan_lower_bound(search.instance, seconds)


def _bound_below_plan(search: Search, seconds: float) -> float | None:
    """Return the bound from the linear programmes of exact methods, which use travel times and integral abilities."""
    instance = search.instance
    if not (instance.workload > 0).any():
        return None
    assert search.fastest is not None
    makespan = search.fastest.evaluation.served_makespan
    low, stopped = min(search.lower_bound, makespan), lambda: search.interrupted
    pairs = count_classes(instance, by_place=False) * instance.m
    if pairs > min(LP_SIZE_LIMIT, LP_PAIRS_PER_SECOND * seconds):
        end = time.monotonic() + seconds
        if not _has_few_neighbours(instance.reach, seconds_for_bounds(search)) or instance.reach.neighbours is None:
            return None
        from alloc.allocators.exact.makespan.task_prices import bound_by_task_prices  # loads numba

        return bound_by_task_prices(instance, low, makespan, end, stopped)
    from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound  # loads scipy
    from alloc.allocators.exact.model import Model

    classes = agent_classes(instance, by_place=False)
    model = Model.build(instance, classes, int(np.count_nonzero(instance.workload)))
    return relaxed_lower_bound(model, low, makespan, seconds, stopped)[0]


def _has_few_neighbours(reach: Reach, seconds: float) -> bool:
    """Return whether reach is short enough for the pairs within it to be gathered in `seconds`.

    Pairs that a method has gathered already make no difference: the bound must not depend on what ran before.
    """
    return not (reach.has_table or reach.is_complete) and estimated_pairs(reach) <= GATHERED_PER_SECOND * seconds


def bounds_after(search: Search, proposal: Proposal) -> float | None:
    """Reduce the gap by linear programmes, which take about a tenth of the time limit in total.

    Parameters
    ----------
    search : Search
        A run with a best allocation; its makespan bound is raised.
    proposal : Proposal
        Returned by the method, with the bounds that it proved.

    Returns
    -------
    float or None
        The bound on the energy; None if energy is not part of the objective, or no bound was found.
    """
    seconds = seconds_for_bounds(search)
    end = time.monotonic() + seconds
    if not search.fast_enough and seconds > 0:
        raise_makespan_bound(search, end)
    if search.objective is Objective.MAKESPAN or search.best is None or search.best.evaluation.makespan is None:
        return None
    if search.best.evaluation.cost == 0:
        return 0.0
    known = proposal.energy_lower_bound
    if seconds == 0 or (known is not None and known >= search.best.evaluation.cost * (1 - PROVEN)):
        return known
    makespan, seconds = search.makespan_limit, max(0.0, end - time.monotonic())
    found = _unless_interrupted(search, lambda: energy_lower_bound(search.instance, makespan, seconds))
    return max((bound for bound in (known, found) if bound is not None), default=None)


def seconds_for_bounds(search: Search) -> float:
    """Return the seconds for linear programmes: 0.1 after a stop request, or 0 if the solver is not loaded yet."""
    if search.interrupted:
        return 0.1 if "scipy.optimize" in sys.modules else 0.0
    limit = search.budget.time_limit_s
    return bounds_s(10.0 if limit is None else limit)


def bounds_s(limit_s: float) -> float:
    """Return the seconds for linear programmes after a run with this time limit; 0 if it is at most `SHORT_S`."""
    return 0.0 if limit_s <= SHORT_S else min(0.2, (limit_s - SHORT_S) / 2) + 0.1 * min(10.0, limit_s)


def _unless_interrupted(search: Search, work: Callable[[], float | None]) -> float | None:
    """Run `work`, but return None early on a stop request, which the linear programmes themselves do not check."""
    before = search.interrupted
    return run_native(work, lambda: search.interrupted and not before, lambda: None)
