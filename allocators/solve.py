"""The recipe: load the method, run it, serve what it left unserved, score the answer, prove what can be proven."""

import os
import threading
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np

from alloc.allocators.auto import choose
from alloc.allocators.base import Allocator, Proposal, RefusedError
from alloc.allocators.interrupt import signals_set
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.search import PROVEN, Budget, Improvement, Search, StopReason, relative_gap
from alloc.problems import (
    Allocation,
    InputError,
    Instance,
    Objective,
    contested_tasks,
    energy_lower_bound,
    lp_makespan_lower_bound,
    serve_all,
)


def solve(
    instance: Instance,
    method: str | Allocator = "auto",
    *,
    objective: Objective | str = Objective.MAKESPAN,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    target_gap: float | None = None,
    seed: int = 0,
    start: Allocation | None = None,
    threads: int | None = None,
    on_improvement: Callable[[Improvement], None] | None = None,
    stop: threading.Event | None = None,
    handle_signals: bool = True,
    **options: Any,
) -> Result:
    """Allocate the agents of `instance` to its tasks.

    Parameters
    ----------
    instance : Instance
    method : str or Allocator
        A name, or an allocator from `load`, which saves loading time in repeated calls.
    objective : Objective or str
        ``makespan``, or ``makespan-energy`` for the least energy at the least makespan.
    time_limit_s, iterations, target_gap
        The budget; see `Budget`.
    seed : int
        Source of all randomness.
    start : Allocation, optional
        A warm start; the answer is never worse.
    threads : int, optional
        Threads that the method may use; as many as there are processors by default.
    on_improvement : callable, optional
        Called with every new best; what it raises ends the run and is passed on.
    stop : threading.Event, optional
        Setting it ends the run as the time limit does.
    handle_signals : bool
        Whether SIGINT and SIGTERM end the run as the time limit does, when called from the main thread.
    **options
        Options of the method, such as ``policy`` and ``device`` of ``gappo``.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If the method or an option is unknown, or the budget is negative.
    RefusedError
        If the method cannot handle this instance within this budget; the message says why.
    """
    goal, budget = Objective(objective), Budget(time_limit_s, iterations, target_gap)
    notes: list[str] = []
    if method == "auto":
        method, reason = choose(instance, goal, budget)
        notes.append(f"auto picked {method}: {reason}")
    if isinstance(method, Allocator) and options:
        raise InputError(f"an allocator that is loaded already takes no options, got {', '.join(options)}", "method")
    allocator = load(method, **options) if isinstance(method, str) else method
    refuse(allocator, instance, goal, budget)
    stop = stop or threading.Event()
    with signals_set(stop) if handle_signals else nullcontext():
        search = Search(
            instance,
            goal,
            budget,
            seed=seed,
            start=start,
            threads=threads or available_threads(),
            on_improvement=on_improvement,
            stop=stop,
        )
        proposal = allocator.allocate(search)
        stop_reason = search.stop_reason()
        if proposal.allocation is not None:
            search.submit(proposal.allocation)
        if search.best is not None and search.best.evaluation.unserved_tasks:
            search.submit(serve_all(instance, search.best.allocation))
        runtime_s = search.elapsed_s
        return _conclude(search, allocator.method.name, proposal, stop_reason, runtime_s, notes)


def available_threads() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def refuse(allocator: Allocator, instance: Instance, objective: Objective, budget: Budget) -> None:
    """Raise `RefusedError` if `allocator` cannot handle `instance` within `budget`."""
    method = allocator.method
    reason = None
    if instance.has_travel_time and not method.finite_speeds:
        reason = "finite speeds are beyond it; use greedy, cpsat or milp"
    elif objective not in method.objectives:
        reason = f"it does not optimise {objective}"
    reason = reason or allocator.refusal(instance, objective, budget)
    if reason is not None:
        raise RefusedError(f"method {method.name!r} refuses {instance.name!r}: {reason}")


def _conclude(
    search: Search,
    name: str,
    proposal: Proposal,
    stop_reason: StopReason | None,
    runtime_s: float,
    notes: list[str],
) -> Result:
    instance, best = search.instance, search.best
    search.raise_bound(proposal.makespan_lower_bound or 0.0)
    infeasible = best is not None and bool(best.evaluation.unserved_tasks)
    if infeasible:
        notes.append(_contest(instance))
    energy_bound = None if infeasible or best is None else _tighten(search, proposal)
    proven = search.gap <= PROVEN and (
        search.objective is Objective.MAKESPAN
        or (
            best is not None
            and energy_bound is not None
            and relative_gap(best.evaluation.energy, energy_bound) <= PROVEN
        )
    )
    return Result(
        instance=instance,
        method=name,
        objective=search.objective,
        seed=search.seed,
        allocation=None if best is None else best.allocation,
        evaluation=None if best is None else best.evaluation,
        lower_bound=None if infeasible else search.lower_bound,
        energy_lower_bound=energy_bound,
        stop_reason=stop_reason or (StopReason.PROVEN if proven else StopReason.FINISHED),
        runtime_s=runtime_s,
        trace=tuple(search.trace),
        notes=tuple(notes),
    )


def _tighten(search: Search, proposal: Proposal) -> float | None:
    """Close the gap further by linear programmes, within a twentieth of the budget each; return the energy bound."""
    instance, limit = search.instance, search.budget.time_limit_s
    patience_s = 0.2 if search.interrupted else 0.2 + 0.05 * min(10.0, 10.0 if limit is None else limit)
    if search.gap > PROVEN:
        search.raise_bound(lp_makespan_lower_bound(instance, patience_s) or 0.0)
    if search.objective is Objective.MAKESPAN or search.best is None or search.best.evaluation.makespan is None:
        return None
    if search.best.evaluation.energy == 0:
        return 0.0
    known = proposal.energy_lower_bound
    if known is not None and known >= search.best.evaluation.energy * (1 - PROVEN):
        return known
    found = energy_lower_bound(instance, search.best.evaluation.makespan, patience_s)
    return max((bound for bound in (known, found) if bound is not None), default=None)


def _contest(instance: Instance) -> str:
    """Say which tasks compete for too few agents."""
    tasks = contested_tasks(instance)
    assert tasks is not None, "tasks are left unserved although a matching serves all"
    able = int(np.any(instance.reach.mask[:, tasks], axis=1, keepdims=True)[instance.reach.origin].sum())
    ids = [repr(instance.task_ids[j]) for j in tasks[:10].tolist()]
    more = f" and {len(tasks) - 10} more" if len(tasks) > 10 else ""
    if len(tasks) == 1:
        return f"no agent can take task {ids[0]}"
    agents = "only 1 agent" if able == 1 else f"only {able} agents"
    return f"{agents} can take any of the {len(tasks)} tasks {', '.join(ids)}{more}"
