"""The end of a run: what is proven of the best allocation, and the result."""

import time

from alloc.allocators.bounds import bounds_after, raise_makespan_bound, seconds_for_bounds
from alloc.allocators.contract.base import Proposal
from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import EXACT, PROVEN, relative_gap
from alloc.allocators.decomposition import Decomposition
from alloc.allocators.result import Result
from alloc.problems import (
    Allocation,
    Instance,
    Objective,
    evaluate,
    makespan_lower_bound,
    minimal_unservable_set,
)
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import IntArray
from alloc.problems.text import labelled, number

MOST_NAMES = 10
"""Ids of competing tasks in a note before it is cut."""


def conclude(
    search: Search,
    decomposition: Decomposition | None,
    method: str,
    proposal: Proposal,
    stop_reason: StopReason | None,
    notes: list[str],
    *,
    pinned: bool = False,
) -> Result:
    """Prove what can be proven of the best allocation, and return the result.

    Parameters
    ----------
    search : Search
        The run on the whole instance, at its end.
    decomposition : Decomposition or None
        Where not every task can be served.
    method : str
        Name of the method that ran.
    proposal : Proposal
        What it returned.
    stop_reason : StopReason or None
        Why it stopped before its own end.
    notes : list of str
        Messages for the user so far.
    pinned : bool
        Whether there are agents that are pinned.

    Returns
    -------
    Result
    """
    runtime_s = search.elapsed_s
    best = search.best
    infeasible = best is not None and bool(best.evaluation.unserved_tasks)
    notes = [*notes, *proposal.notes]
    if infeasible:
        notes.append(("besides the pinned agents, " if pinned else "") + _contention(search, decomposition))
    elif best is not None and search.tolerance.limit is not None:
        notes.extend(_unmet(search, search.tolerance.limit))
    if decomposition is not None:
        notes.extend(_concluded(decomposition, search))
    energy_bound = None
    if best is not None and not infeasible:
        with search.improving("proving a bound"):
            energy_bound = bounds_after(search, proposal)
    if stop_reason is None:
        stop_reason = StopReason.PROVEN if _is_proven(search, energy_bound) else StopReason.FINISHED
    return Result(
        instance=search.instance,
        method=method,
        objective=search.objective,
        seed=search.seed,
        allocation=None if best is None else best.allocation,
        evaluation=None if best is None else best.evaluation,
        lower_bound=None if infeasible else search.lower_bound,
        energy_lower_bound=energy_bound,
        stop_reason=stop_reason,
        runtime_s=runtime_s,
        trace=tuple(search.trace),
        notes=(*notes, *search.notes),
        makespan_limit=None if infeasible or search.tolerance == EXACT else search.makespan_limit,
        tolerance=search.tolerance,
    )


def _unmet(search: Search, limit: float) -> list[str]:
    """Return a note where no plan keeps to the makespan limit that was given."""
    assert search.best is not None
    units, makespan = search.instance.units, search.best.evaluation.served_makespan
    if makespan <= last_equal(limit):
        return []
    most, least = (labelled(number(value), units.time) for value in (limit, search.lower_bound))
    return [f"no plan was found within the makespan limit {most}; any takes {least} at least"]


def _concluded(decomposition: Decomposition, search: Search) -> list[str]:
    """Raise the bound on the makespan of the tasks that are served, and return the notes."""
    if decomposition.rest is not None and not decomposition.rest.fast_enough:
        raise_makespan_bound(decomposition.rest, time.monotonic() + seconds_for_bounds(search))
    return decomposition.notes()


def _is_proven(search: Search, energy_bound: float | None) -> bool:
    """Whether every stage of the objective is proven."""
    if not search.fast_enough or search.objective is Objective.MAKESPAN:
        return search.fast_enough
    if search.best is None or energy_bound is None:
        return False
    return relative_gap(search.best.evaluation.cost, energy_bound) <= PROVEN


def _contention(search: Search, decomposition: Decomposition | None) -> str:
    """Return the note on the tasks that compete for too few agents."""
    instance = search.instance
    tasks: IntArray | None
    if decomposition is not None and decomposition.shortage.is_proven:
        tasks = decomposition.shortage.unservable
    elif decomposition is None and search.budget.time_limit_s is None:
        tasks = minimal_unservable_set(instance)
    else:
        return "time ran out before it was proven that no plan serves more tasks"
    assert tasks is not None, "tasks are left unserved although a matching serves all"
    ids = [repr(instance.task_ids[j]) for j in tasks[:MOST_NAMES].tolist()]
    more = f" and {len(tasks) - MOST_NAMES} more" if len(tasks) > MOST_NAMES else ""
    able = len(tasks) - 1
    if not able:
        return f"no agent can take task {ids[0]}"
    agents = "only 1 agent" if able == 1 else f"only {able} agents"
    return f"{agents} can take any of the {len(tasks)} tasks {', '.join(ids)}{more}"


def scored_result(instance: Instance, allocation: Allocation, method: str = "given") -> Result:
    """Return the scores of an allocation, wherever it comes from, as a result, with a bound that is cheap to compute.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation
    method : str
        What the result calls the method.

    Raises
    ------
    InputError
        If the allocation does not belong to the instance.
    """
    score = evaluate(instance, allocation)
    return Result(
        instance=instance,
        method=method,
        objective=Objective.MAKESPAN,
        seed=0,
        allocation=allocation,
        evaluation=score,
        lower_bound=None if score.unserved_tasks else makespan_lower_bound(instance),
        energy_lower_bound=None,
        stop_reason=StopReason.FINISHED,
        runtime_s=0.0,
        trace=(),
    )
