"""`solve`: check the arguments, load the method, run it, score its answer, and prove bounds."""

import importlib
import math
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace

import numpy as np

from alloc.allocators.auto import choose
from alloc.allocators.bounds import SHORT_S, raise_bound_before
from alloc.allocators.conclusion import conclude
from alloc.allocators.contract.base import Allocator, Proposal
from alloc.allocators.contract.budget import Budget, StopReason
from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import EXACT
from alloc.allocators.decomposition import Decomposition
from alloc.allocators.heuristic.greedy.list_schedule import load_compiled
from alloc.allocators.proof.early import EarlyProof, needs_solver
from alloc.allocators.refusal import refuse
from alloc.allocators.registry import load, takers
from alloc.allocators.replanning.plan import concluded, replanning
from alloc.allocators.request import (
    Request,
    Start,
    as_start,
    checked_pins,
    checked_threads,
    checked_tolerance,
    default_threads,
)
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import raise_if_cancelled, signals_set, stopped_at_exit
from alloc.problems import InputError, Instance, Objective, find_shortage, serve_all
from alloc.problems.allocation import CarriedOver
from alloc.problems.arguments import checked_seed, choice, event, flag, function, of_type, real

REPAIR_S = 0.2
"""Seconds for serving further tasks after a run whose time is up."""

MATCHED_PAIRS = 1_000_000
"""Number of pairs of origin and task above which the libraries for matchings are loaded before the run."""

REPAIR_SHARE = 0.05
"""Share of the time limit for repairing a plan in force after the method has ended."""

SLACK_AGENTS, SLACK_LIMIT_S = 20_000, 0.5
"""Most agents, and least time limit in seconds, for estimating what slack would save; it must take little of a run."""


def solve(
    instance: Instance,
    method: str | Allocator = "auto",
    *,
    objective: Objective | str = Objective.MAKESPAN,
    time_limit_s: float | None = 10.0,
    iterations: int | None = None,
    target_gap: float | None = None,
    seed: int = 0,
    start: Start | None = None,
    threads: int | None = None,
    makespan_slack: float = 0.0,
    makespan_limit: float | None = None,
    move_price: float = 0.0,
    pins: Mapping[str, str | None] | None = None,
    on_improvement: Callable[[Improvement], None] | None = None,
    stop: threading.Event | None = None,
    handle_signals: bool = True,
    parameters: object = None,
    **settings: object,
) -> Result:
    """Allocate the agents of an instance to its tasks.

    Parameters
    ----------
    instance : Instance
    method : str or Allocator
        A name, or an allocator with its own parameters, such as ``GeneticAlgorithm(population=200)``.
    objective : Objective or str
        ``makespan``; ``makespan-energy`` for the least energy at the least makespan; or ``makespan-moves`` for the
        fewest agents whose task differs from that in `start`.
    time_limit_s, iterations, target_gap
        The budget; see `Budget`.
    seed : int
        Seed of all random numbers, from 0 to 2^63 - 1.
    start : Allocation, Result or dict, optional
        A warm start; the answer is never worse. A dict maps agent ids to task ids, or None for idle. Agents and tasks
        that the instance no longer has are left out.
    threads : int, optional
        Threads that the method may use. By default the number of processors, or one if the budget limits iterations
        but not time, so that the answer is the same on every machine.
    makespan_slack, makespan_limit : float
        Relative excess over the fastest allocation found, and makespan in hours, up to which makespans are equally
        good, so that the energy decides; for the objective ``makespan-energy``. See `MakespanTolerance`.
    move_price : float
        Energy that is added to the cost for each agent whose task differs from that in `start`; for the objective
        ``makespan-energy``.
    pins : mapping, optional
        Agents that must do a given task: its id, or None for idle, by agent id.
    on_improvement : callable, optional
        Called with every new best; an exception from it ends the run and propagates.
    stop : threading.Event, optional
        Setting it ends the run, as the time limit does.
    handle_signals : bool
        Whether SIGINT and SIGTERM end the run, as the time limit does, if `solve` is called from the main thread.
    parameters : object, optional
        Parameters of a method given by name: an instance of its `Allocator.parameters_type`, or a mapping by name.
    **settings
        Single parameters of a method given by name, such as ``population`` of ``ga`` or ``policy`` of ``gappo``; see
        `method_parameters`.

    Returns
    -------
    Result

    Raises
    ------
    InputError
        If the method or a parameter is unknown, or an argument is wrong; its `place` is the parameter.
    RefusedError
        If the method cannot handle this instance within this budget; the message says why.
    """
    of_type(instance, Instance, "instance")
    of_type(method, (str, Allocator), "method")
    goal = choice(Objective, objective, "objective")
    plan, carried = (None, CarriedOver()) if start is None else as_start(instance, start)
    price = float(real(move_price, "move_price"))
    tell = function(on_improvement, "on_improvement")
    plan_in_force = replanning(instance, goal, plan, carried, price, checked_pins(pins))
    budget = Budget(time_limit_s, iterations, target_gap)
    request = Request(
        instance=plan_in_force.priced_instance,
        objective=plan_in_force.method_objective,
        budget=budget,
        tolerance=checked_tolerance(makespan_slack, makespan_limit, goal),
        seed=checked_seed(seed),
        start=None if plan is None else plan_in_force.completed(plan),
        threads=checked_threads(threads) or default_threads(budget),
        on_improvement=None if tell is None else lambda improvement: tell(plan_in_force.on_instance(improvement)),
        stop=event(stop, "stop") or threading.Event(),
        pinned=bool(plan_in_force.pinned.any()),
    )
    handle_signals = flag(handle_signals, "handle_signals")
    carried_notes = [f"since the plan was made, {carried}"] if str(carried) else []
    allocator, notes, spent_s = _prepared(method, request, parameters, settings)
    with stopped_at_exit(request.stop.set), signals_set(request.stop) if handle_signals else nullcontext():
        result = _run(allocator, request, [*notes, *carried_notes], spent_s)
    return concluded(replace(result, parameters=allocator.changed_parameters()), plan_in_force)


def _prepared(
    method: str | Allocator, request: Request, parameters: object, settings: dict[str, object]
) -> tuple[Allocator, list[str], float]:
    """Choose and load the method, and check that it does not refuse; loading is not part of the run.

    Returns
    -------
    allocator : Allocator
    notes : list of str
        The choice of ``auto``, and the reason.
    spent_s : float
        Seconds that count as part of the run.
    """
    notes: list[str] = []
    begin = time.monotonic()
    if method == "auto":
        _require_none(parameters, settings)
        method, reason = choose(request.instance, request.objective, request.budget)
        notes.append(f"auto picked {method}: {reason}")
        parameters, settings = None, {}
    spent_s = time.monotonic() - begin
    if isinstance(method, Allocator) and (settings or parameters is not None):
        given = ", ".join(settings) or "parameters"
        raise InputError(f"is an allocator with its own parameters; set {given} when creating it", "method")
    allocator = load(method, parameters, **settings) if isinstance(method, str) else method
    if _is_repaired(request.instance) or _slack_may_save(allocator, request):
        from alloc.allocators.heuristic.local_search.annealing_state import compile_loops

        compile_loops()  # for the repair and the savings after the run; loading is not part of the run
    begin = time.monotonic()
    refuse(allocator, request.instance, request.objective, request.budget, request.tolerance)
    is_matched = _is_matched(request.instance)
    spent_s += time.monotonic() - begin
    allocator.prepare(request.instance)
    load_compiled(request.instance)  # loading is not part of the run
    for library in ("scipy.spatial", "scipy.sparse.csgraph") if is_matched else ():
        importlib.import_module(library)
    is_early = _is_proven_early(allocator, request.budget) and needs_solver(request.instance, request.objective)
    if is_early or request.budget.target_gap is not None:
        importlib.import_module("scipy.optimize")  # for bounds before and during the run
    return allocator, notes, spent_s


def _is_repaired(instance: Instance) -> bool:
    """Return whether moves have a price, so that the plan is repaired at the end; pins alone need no repair."""
    move = instance.reach.move
    return move is not None and bool(move.price.any())


def _slack_may_save(allocator: Allocator, run: Request | Search) -> bool:
    """Return whether slack may save much energy: with fractional abilities, the least makespan may be costly."""
    if run.objective is not Objective.MAKESPAN_ENERGY or run.tolerance != EXACT or run.instance.reach.move is not None:
        return False
    limit, method = run.budget.time_limit_s, allocator.method
    if run.instance.n > SLACK_AGENTS or (limit is not None and limit < SLACK_LIMIT_S):
        return False
    has_fractions = bool((run.instance.ability != np.round(run.instance.ability)).any())
    return method.anytime and method.makespan_slack and has_fractions


def _is_matched(instance: Instance) -> bool:
    """Return whether matchings are certainly needed, or are likely and large enough for loading to be negligible."""
    many = instance.reach.pairs > MATCHED_PAIRS and not instance.reach.is_complete
    return many or instance.n < int(np.count_nonzero(instance.workload))


def _is_proven_early(allocator: Allocator, budget: Budget) -> bool:
    """Return whether to prove bounds during the run: for anytime methods without proofs, unless the run is short."""
    is_short = budget.time_limit_s is not None and budget.time_limit_s <= SHORT_S
    return allocator.method.anytime and not allocator.method.proves and not is_short


def _require_none(parameters: object, settings: dict[str, object]) -> None:
    """Raise an error if there are parameters: ``auto`` may pick a method that does not have them."""
    given = [name for name, value in {**settings, "parameters": parameters}.items() if value is not None]
    if given:
        found = takers(given[0])
        such = f", such as {found[0]}" if found else ""
        raise InputError(f"needs a named method that has it{such}; auto may pick one without it", given[0])


def _run(allocator: Allocator, request: Request, notes: list[str], spent_s: float) -> Result:
    """Run the method on the instance, or on its part in which every task can be served."""
    instance, begin = request.instance, time.monotonic()
    limit = request.budget.time_limit_s
    end = math.inf if limit is None else begin - spent_s + limit
    shortage = find_shortage(instance, lambda: 0.0 if request.stop.is_set() else end - time.monotonic())
    search = Search(
        instance,
        request.objective,
        request.budget,
        seed=request.seed,
        start=request.start if shortage is None else None,
        threads=request.threads,
        tolerance=request.tolerance,
        on_improvement=request.on_improvement,
        stop=request.stop,
        spent_s=spent_s + time.monotonic() - begin,
    )
    raise_if_cancelled(request.stop)
    decomposition = None if shortage is None else Decomposition(search, shortage, request)
    part = search if decomposition is None else decomposition.rest
    proposal, stop_reason = (Proposal(), None) if part is None else _propose(allocator, part, request.stop)
    if decomposition is not None:
        decomposition.conclude()
    return conclude(search, decomposition, allocator.method.name, proposal, stop_reason, notes, pinned=request.pinned)


def _propose(allocator: Allocator, search: Search, stop: threading.Event) -> tuple[Proposal, StopReason | None]:
    """Run the method, submit its answer, and serve tasks that it left; return the proposal, and why it stopped."""
    if search.budget.target_gap is not None and not allocator.method.proves:
        raise_bound_before(search)
    proof = EarlyProof(search) if _is_proven_early(allocator, search.budget) else None
    proposal = allocator.allocate(search)
    raise_if_cancelled(stop)
    stop_reason = search.stop_reason()
    if proposal.allocation is not None:
        search.submit(proposal.allocation)
    if search.best is not None and search.best.evaluation.unserved_tasks:
        end = time.monotonic() + max(REPAIR_S, search.remaining_s)
        search.submit(serve_all(search.instance, search.best.allocation, lambda: end - time.monotonic()))
    if proof is not None:
        proposal = proof.added_to(proposal, search)
    search.raise_bound(proposal.makespan_lower_bound or 0.0)
    if search.best is not None and _is_repaired(search.instance):
        from alloc.allocators.heuristic.local_search.improve import repair

        limit = search.budget.time_limit_s
        repair(search, seconds=math.inf if limit is None else max(REPAIR_S, REPAIR_SHARE * limit))
    if _slack_may_save(allocator, search):
        from alloc.allocators.heuristic.slack import note_saving

        with search.improving("estimating what slack saves"):
            note_saving(search)
    raise_if_cancelled(stop)
    return proposal, stop_reason
