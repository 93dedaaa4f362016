"""The recipe: load the method, run it, serve what it left unserved, score the answer, prove what can be proven."""

import importlib
import math
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from typing import Any

from alloc.allocators.auto import choose
from alloc.allocators.contract.base import Allocator, Proposal, RefusedError
from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.search import Improvement, Search
from alloc.allocators.contract.tolerance import EXACT, PROVEN, MakespanTolerance, relative_gap
from alloc.allocators.parallel.processors import available_threads
from alloc.allocators.registry import BUILT_IN, load
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import ended_with_process, run_native, signals_set
from alloc.allocators.split import Split
from alloc.problems import (
    Allocation,
    InputError,
    Instance,
    Objective,
    energy_lower_bound,
    find_shortage,
    lp_makespan_lower_bound,
    minimal_unservable_set,
    serve_all,
)
from alloc.problems.allocation import require_fit
from alloc.problems.arguments import choice, event, flag, function, of_type, real, whole

UNHURRIED_S = 30.0
"""Limit of the linear programme before a run that counts iterations: no clock should decide where it ends."""

REPAIR_S = 0.3
"""Time to serve more tasks after a run whose own time is up."""

LARGEST_SEED = 2**63 - 1
MOST_THREADS = 1024


def solve(
    instance: Instance,
    method: str | Allocator = "auto",
    *,
    objective: Objective | str = Objective.MAKESPAN,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    target_gap: float | None = None,
    seed: int = 0,
    start: Allocation | Result | Mapping[str, str | None] | None = None,
    threads: int | None = None,
    makespan_slack: float = 0.0,
    makespan_limit: float | None = None,
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
    start : Allocation, Result or dict, optional
        A warm start; the answer is never worse. A dict gives the task id of each agent id, None for idle.
    threads : int, optional
        Threads that the method may use; as many as there are processors by default.
    makespan_slack, makespan_limit : float
        Relative excess over the fastest allocation found, and hours, up to which makespans are equally good, so that
        the energy decides; for the objective ``makespan-energy``. See `MakespanTolerance`.
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
        If the method or an option is unknown, or another argument is not what it should be; its place is the parameter.
    RefusedError
        If the method cannot handle this instance within this budget; the message says why.
    """
    of_type(instance, Instance, "instance")
    of_type(method, (str, Allocator), "method")
    goal, budget = choice(Objective, objective, "objective"), Budget(time_limit_s, iterations, target_gap)
    tolerance = _tolerance(makespan_slack, makespan_limit)
    seed = whole(seed, "seed", 0, LARGEST_SEED)
    threads = None if threads is None else whole(threads, "threads", 1, MOST_THREADS)
    begun = None if start is None else as_allocation(instance, start, "start")
    function(on_improvement, "on_improvement")
    event(stop, "stop")
    handle_signals = flag(handle_signals, "handle_signals")
    if goal is Objective.MAKESPAN and tolerance != EXACT:
        option = "makespan_slack" if makespan_slack else "makespan_limit"
        raise InputError(f"leaves room for less energy; it is for the objective {Objective.MAKESPAN_ENERGY}", option)
    notes: list[str] = []
    begin = time.monotonic()
    if method == "auto":
        given = [name for name, value in options.items() if value is not None]
        if given:
            raise InputError("is for a method that you name, such as gappo; auto may pick one without it", given[0])
        method, reason = choose(instance, goal, budget)
        notes.append(f"auto picked {method}: {reason}")
    spent_s = time.monotonic() - begin
    if isinstance(method, Allocator) and options:
        raise InputError(f"an allocator that is loaded already takes no options, got {', '.join(options)}", "method")
    allocator = load(method, **options) if isinstance(method, str) else method
    begin = time.monotonic()
    refuse(allocator, instance, goal, budget, tolerance)
    spent_s += time.monotonic() - begin
    if target_gap is not None:
        importlib.import_module("scipy.optimize")  # for the bound below; loading counts for no method
    stop = stop or threading.Event()
    with ended_with_process(stop.set), signals_set(stop) if handle_signals else nullcontext():
        end = math.inf if time_limit_s is None else time.monotonic() - spent_s + time_limit_s
        begin = time.monotonic()
        shortage = find_shortage(instance, lambda: 0.0 if stop.is_set() else end - time.monotonic())
        search = Search(
            instance,
            goal,
            budget,
            seed=seed,
            start=begun if shortage is None else None,
            threads=threads or available_threads(),
            tolerance=tolerance,
            on_improvement=on_improvement,
            stop=stop,
            spent_s=spent_s + time.monotonic() - begin,
        )
        split = None if shortage is None else Split(search, shortage, begun, stop)
        part = search if split is None else split.search
        proposal, stop_reason = (Proposal(), None) if part is None else _run(allocator, part)
        if split is not None:
            split.conclude()
        runtime_s = search.elapsed_s
        notes.extend(proposal.notes)
        return _conclude(search, split, allocator.method.name, proposal, stop_reason, runtime_s, notes)


def _run(allocator: Allocator, search: Search) -> tuple[Proposal, StopReason | None]:
    """Have `allocator` solve the instance of `search`, and serve what it left unserved; say why it stopped."""
    if search.budget.target_gap is not None and not allocator.method.proves:
        seconds = UNHURRIED_S if search.budget.time_limit_s is None else _patience_s(search)
        _raise_by_programme(search, time.monotonic() + seconds)
    proposal = allocator.allocate(search)
    stop_reason = search.stop_reason()
    if proposal.allocation is not None:
        search.submit(proposal.allocation)
    if search.best is not None and search.best.evaluation.unserved_tasks:
        end = time.monotonic() + max(REPAIR_S, search.remaining_s)
        search.submit(serve_all(search.instance, search.best.allocation, lambda: end - time.monotonic()))
    search.raise_bound(proposal.makespan_lower_bound or 0.0)
    return proposal, stop_reason


def _tolerance(makespan_slack: float, makespan_limit: float | None) -> MakespanTolerance:
    slack = real(makespan_slack, "makespan_slack")
    limit = None if makespan_limit is None else real(makespan_limit, "makespan_limit", above=True, unit="of hours ")
    return MakespanTolerance(slack, limit)


def as_allocation(instance: Instance, given: Allocation | Result | Mapping[str, str | None], name: str) -> Allocation:
    """Return an allocation of `instance`, which is that of a result, or ids of tasks by ids of agents.

    Raises
    ------
    InputError
        If it is none of these, or does not belong to `instance`; its place is `name`.
    """
    try:
        if isinstance(given, Mapping):
            return Allocation.from_ids(instance, given)
        if isinstance(given, Result):
            return _allocation_of(given, instance)
        allocation = of_type(given, (Allocation, Result), name)
        assert isinstance(allocation, Allocation)
        require_fit(instance, allocation)
        return allocation
    except InputError as error:
        raise InputError(error.message, name) from error


def _allocation_of(result: Result, instance: Instance) -> Allocation:
    if result.allocation is None:
        raise InputError("is a result without an allocation")
    theirs = result.instance
    if (theirs.agent_ids, theirs.task_ids) == (instance.agent_ids, instance.task_ids):
        return result.allocation
    return Allocation.from_ids(instance, result.allocation.to_ids(theirs))


def refuse(
    allocator: Allocator, instance: Instance, objective: Objective, budget: Budget, tolerance: MakespanTolerance = EXACT
) -> None:
    """Raise `RefusedError` if `allocator` cannot handle `instance` within `budget`."""
    method = allocator.method
    reason = None
    if instance.has_travel_time and not method.finite_speeds:
        able = [name for name, other in BUILT_IN.items() if other.finite_speeds]
        reason = f"finite speeds are beyond it; use {_either(able)}"
    elif objective not in method.objectives:
        reason = f"it does not optimise {objective}"
    elif tolerance != EXACT and not method.makespan_slack:
        able = [name for name, other in BUILT_IN.items() if other.makespan_slack]
        reason = f"it makes no use of slack for the makespan; use {_either(able)}"
    reason = reason or allocator.refusal(instance, objective, budget)
    if reason is not None:
        raise RefusedError(f"method {method.name!r} refuses {instance.name!r}: {reason}")


def _either(names: list[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _conclude(
    search: Search,
    split: Split | None,
    name: str,
    proposal: Proposal,
    stop_reason: StopReason | None,
    runtime_s: float,
    notes: list[str],
) -> Result:
    instance, best = search.instance, search.best
    infeasible = best is not None and bool(best.evaluation.unserved_tasks)
    if infeasible:
        notes.append(_unservable(search, split))
    if split is not None:
        if split.search is not None and not split.search.fast_enough:
            _raise_by_programme(split.search, time.monotonic() + _patience_s(search))
        notes.extend(split.notes())
    energy_bound = None
    if best is not None and not infeasible:
        with search.improving("proving a bound"):
            energy_bound = _tighten(search, proposal)
    proven = search.fast_enough and (
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
        notes=(*notes, *search.notes),
        makespan_limit=None if infeasible or search.tolerance == EXACT else search.makespan_limit,
        tolerance=search.tolerance,
    )


def _tighten(search: Search, proposal: Proposal) -> float | None:
    """Close the gap further by linear programmes, within a tenth of the time limit in all; return the energy bound."""
    end = time.monotonic() + _patience_s(search)
    if not search.fast_enough:
        _raise_by_programme(search, end)
    if search.objective is Objective.MAKESPAN or search.best is None or search.best.evaluation.makespan is None:
        return None
    if search.best.evaluation.energy == 0:
        return 0.0
    known = proposal.energy_lower_bound
    if known is not None and known >= search.best.evaluation.energy * (1 - PROVEN):
        return known
    makespan, seconds = search.makespan_limit, max(0.0, end - time.monotonic())
    found = _unless_interrupted(search, lambda: energy_lower_bound(search.instance, makespan, seconds))
    return max((bound for bound in (known, found) if bound is not None), default=None)


def _raise_by_programme(search: Search, end: float) -> None:
    """Raise the bound on the makespan by a linear programme that ends at `end` on the monotonic clock."""
    seconds = max(0.0, end - time.monotonic())
    search.raise_bound(_unless_interrupted(search, lambda: lp_makespan_lower_bound(search.instance, seconds)) or 0.0)


def _unless_interrupted(search: Search, work: Callable[[], float | None]) -> float | None:
    """Run `work`, but let a signal come first: a linear programme ends for its time limit alone."""
    before = search.interrupted
    return run_native(work, lambda: search.interrupted and not before, lambda: None)


def _patience_s(search: Search) -> float:
    """Seconds for linear programmes after the run; after an interrupt hardly any, and none to load a solver."""
    if search.interrupted:
        return 0.1 if "scipy.optimize" in sys.modules else 0.0
    limit = search.budget.time_limit_s
    return 0.2 + 0.1 * min(10.0, 10.0 if limit is None else limit)


def _unservable(search: Search, split: Split | None) -> str:
    """Say which tasks compete for too few agents."""
    instance = search.instance
    if split is not None and split.shortage.is_proven:
        tasks = split.shortage.unservable
    elif split is None and search.budget.time_limit_s is None:
        tasks = minimal_unservable_set(instance)
    else:
        return "time ran out before it was proven that no plan serves more tasks"
    assert tasks is not None, "tasks are left unserved although a matching serves all"
    ids = [repr(instance.task_ids[j]) for j in tasks[:10].tolist()]
    more = f" and {len(tasks) - 10} more" if len(tasks) > 10 else ""
    able = len(tasks) - 1
    if not able:
        return f"no agent can take task {ids[0]}"
    agents = "only 1 agent" if able == 1 else f"only {able} agents"
    return f"{agents} can take any of the {len(tasks)} tasks {', '.join(ids)}{more}"
