"""The end of a run: proofs for the best allocation, and the result; also the scores of a stored plan."""

import json
import math
import sys
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace

from alloc.allocators.bounds import bounds_after, raise_makespan_bound, seconds_for_bounds
from alloc.allocators.contract.base import Proposal
from alloc.allocators.contract.budget import StopReason
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import EXACT, PROVEN, relative_gap
from alloc.allocators.decomposition import Decomposition
from alloc.allocators.result import Result
from alloc.allocators.result_document import SCORES
from alloc.problems import (
    Allocation,
    InputError,
    Instance,
    Objective,
    evaluate,
    makespan_lower_bound,
    minimal_unservable_set,
)
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import IntArray
from alloc.problems.text import labelled, number

BOUNDS = {"lower_bound": "makespan", "energy_lower_bound": "energy"}
"""Score that each bound applies to."""

CLOSE = 1e-9
"""Relative difference up to which two scores are equal."""

MAX_NAMES = 10
"""Maximum number of ids of competing tasks in a note."""


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
        None if every task can be served.
    method : str
        Name of the method that ran.
    proposal : Proposal
        What it returned.
    stop_reason : StopReason or None
        Why the method stopped; None if it finished by itself.
    notes : list of str
        Messages for the user so far.
    pinned : bool
        Whether any agent is pinned.

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
    """Return a note if the best plan exceeds the given makespan limit."""
    assert search.best is not None
    units, makespan = search.instance.units, search.best.evaluation.served_makespan
    if makespan <= last_equal(limit):
        return []
    most, least = (labelled(number(value), units.time) for value in (limit, search.lower_bound))
    return [f"no plan was found within the makespan limit {most}; every plan takes at least {least}"]


def _concluded(decomposition: Decomposition, search: Search) -> list[str]:
    """Raise the makespan bound for the tasks that are served, and return the notes."""
    if decomposition.rest is not None and not decomposition.rest.fast_enough:
        raise_makespan_bound(decomposition.rest, time.monotonic() + seconds_for_bounds(search))
    return decomposition.notes()


def _is_proven(search: Search, energy_bound: float | None) -> bool:
    """Return whether every stage of the objective is proven."""
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
    ids = [repr(instance.task_ids[j]) for j in tasks[:MAX_NAMES].tolist()]
    more = f" and {len(tasks) - MAX_NAMES} more" if len(tasks) > MAX_NAMES else ""
    able = len(tasks) - 1
    if not able:
        return f"no agent can take task {ids[0]}"
    agents = "only 1 agent" if able == 1 else f"only {able} agents"
    return f"{agents} can take any of the {len(tasks)} tasks {', '.join(ids)}{more}"


def scored_result(instance: Instance, allocation: Allocation, method: str = "given") -> Result:
    """Score an allocation from any source, and return a result with a makespan bound that is cheap to compute.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation
    method : str
        Name of the method in the result.

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


def with_claims(result: Result, claims: Mapping[str, object]) -> tuple[Result, list[str]]:
    """Return the result with the valid bounds of a result file, and a message for each claim that does not hold.

    Parameters
    ----------
    result : Result
        The allocation of the file, scored on this instance.
    claims : mapping
        Fields of the file, unchecked.

    Returns
    -------
    result : Result
    lines : list of str
        Claims of the file that do not hold on this instance. If a score differs, no bound is used, as it was proven for
        another instance.
    """
    wrong = next(_differences(result, claims), None)
    if wrong is not None:
        left_out = any(claims.get(name) is not None for name in BOUNDS)
        return result, [f"{wrong}{'; its bounds are left out' if left_out else ''}"]
    if result.makespan is None:
        return result, []
    lines, bounds = [], {}
    for name, value in BOUNDS.items():
        stated, score = claims.get(name), getattr(result, value)
        bound = _number(stated)
        if bound is not None and bound <= score * (1 + CLOSE):
            bounds[name] = bound
        elif stated is not None:
            lines.append(f"its {name} {_shown(stated)} is no bound on the {value}, {number(score)}, and is left out")
    if "lower_bound" in bounds and not claims.get("pins"):
        result = replace(result, lower_bound=max(bounds["lower_bound"], result.lower_bound or 0.0))
    if claims.get("pins"):
        return result, [*lines, "its bounds hold only with its pins, and are left out"]
    limit = _number(claims.get("makespan_limit"))
    result = replace(result, energy_lower_bound=bounds.get("energy_lower_bound"), makespan_limit=limit)
    return _with_moves(result, claims), lines


def _with_moves(result: Result, claims: Mapping[str, object]) -> Result:
    """Return the result with the moves from the plan in force and the bound on their cost, if the file has them."""
    if claims.get("moves") is None:
        return result
    try:
        return replace(result, moves=Result.from_dict(claims, result.instance).moves)
    except InputError:
        return result


def _differences(result: Result, claims: Mapping[str, object]) -> Iterator[str]:
    """Yield the differences between the file and the result: instance name, agents, scores and unserved tasks."""
    found = result.to_dict()
    if claims.get("instance") not in (None, found["instance"]):
        yield "it is for another instance"
    claimed, assignment = claims.get("assignment"), found["assignment"]
    if isinstance(claimed, dict) and isinstance(assignment, dict) and claimed.keys() != assignment.keys():
        yield "it is for another set of agents"
    for name in SCORES:
        if not _is_close(claims.get(name), found[name]):
            yield f"its {name} is {_shown(claims.get(name))}, but on this instance it is {_shown(found[name])}"
    if claims.get("unserved_tasks", found["unserved_tasks"]) != found["unserved_tasks"]:
        yield "its unserved tasks are not those on this instance"


def _is_close(one: object, other: object) -> bool:
    first, second = _number(one), _number(other)
    return one is other if first is None or second is None else math.isclose(first, second, rel_tol=CLOSE)


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
        return None
    return float(value)


def _shown(value: object) -> str:
    known = _number(value)
    return json.dumps(value)[:60] if known is None else number(known, 10)
