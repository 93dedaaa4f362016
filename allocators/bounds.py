"""Bounds that `solve` proves itself, by linear programmes before and after the method runs."""

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
"""Time limit up to which no linear programme follows the run: even small ones take some milliseconds."""

UNLIMITED_S = 30.0
"""Time limit of the linear programme before a run without one; so long that the clock does not decide."""


def raise_bound_before(search: Search) -> None:
    """Raise the bound on the makespan before the run, so that a target gap is measured from it."""
    seconds = UNLIMITED_S if search.budget.time_limit_s is None else seconds_for_bounds(search)
    raise_makespan_bound(search, time.monotonic() + seconds)


def raise_makespan_bound(search: Search, end: float) -> None:
    """Raise the bound on the makespan by linear programmes that end at `end` on the monotonic clock."""
    seconds = max(0.0, end - time.monotonic())
    prove = _bound_below_plan if search.fastest is not None and search.gap < 1 else _bound_without_plan
    search.raise_bound(_unless_interrupted(search, lambda: prove(search, seconds)) or 0.0)


def _bound_without_plan(search: Search, seconds: float) -> float | None:
    """Return the bound by one linear programme, for where there is no plan yet."""
    return lp_makespan_lower_bound(search.instance, seconds)


def _bound_below_plan(search: Search, seconds: float) -> float | None:
    """Return the bound by the linear programmes of exact methods, which know travel times and whole abilities."""
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
    """Whether reach is short, and the pairs within it can be gathered in so many seconds.

    Pairs that a method has gathered already do not count for it: what is proven must not depend on what ran before.
    """
    return not (reach.has_table or reach.is_complete) and estimated_pairs(reach) <= GATHERED_PER_SECOND * seconds


def bounds_after(search: Search, proposal: Proposal) -> float | None:
    """Close the gap further by linear programmes, within about a tenth of the time limit in all.

    Parameters
    ----------
    search : Search
        A run with a best allocation; its bound on the makespan is raised.
    proposal : Proposal
        Of the method, with the bounds that it proved.

    Returns
    -------
    float or None
        The bound on the energy; None where energy is no objective, or no bound was found.
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
    """Return the seconds for linear programmes; hardly any after a stop request, and none to load a solver."""
    if search.interrupted:
        return 0.1 if "scipy.optimize" in sys.modules else 0.0
    limit = search.budget.time_limit_s
    return bounds_s(10.0 if limit is None else limit)


def bounds_s(limit_s: float) -> float:
    """Return the seconds for linear programmes after a run of so many seconds: few, or none, after a short one."""
    return 0.0 if limit_s <= SHORT_S else min(0.2, (limit_s - SHORT_S) / 2) + 0.1 * min(10.0, limit_s)


def _unless_interrupted(search: Search, work: Callable[[], float | None]) -> float | None:
    """Run `work`, but return early on a stop request: a linear programme ends by its time limit alone."""
    before = search.interrupted
    return run_native(work, lambda: search.interrupted and not before, lambda: None)
