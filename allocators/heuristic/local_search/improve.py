"""Improve any plan by annealing: first its makespan, then its energy within that; or repair a plan in force."""

import math
import time

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState
from alloc.allocators.heuristic.local_search.clock import Clock
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.problems import IDLE, Allocation, Objective, only_allowed
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import FloatArray, IntArray

HARD = 100.0
"""Factor on penalties that makes them outweigh any distance."""

HARD_FROM = 0.95
"""Part of the budget after which no shortfall is accepted."""

FIRST_CYCLE_SHARE = 0.1
"""Part of a long budget for a first annealing cycle, so that a run that is stopped early has a good plan."""

PATIENCE, LEAST_SHARE = 3.0, 0.2
"""Time without a smaller makespan, as a multiple of the time until then, and share of the time for it, after which the
energy has its turn."""

REPORT_INTERVAL = 20.0
"""Time between two reports, as a multiple of the time that scoring one plan takes."""

MOVES_NOISE = 1.0
"""First noise where moves have a price, relative to the mean cost: much, as nearly all moves cost the same."""

REPAIRS_PER_AGENT = 400
"""Most exchanges of a repair, for each agent."""


def improve(
    search: Search,
    *,
    until_s: float = math.inf,
    iterations: float = math.inf,
    parameters: LocalSearchParameters | None = None,
) -> None:
    """Improve ``search.best``, which must exist, and submit better plans.

    Ends when the search should stop, and before that at either limit.

    Parameters
    ----------
    search : Search
        Its best plan is the initial one.
    until_s : float
        Time limit, on ``search.elapsed_s``.
    iterations : float
        Most iterations, of ``parameters.exchanges`` exchanges each.
    parameters : LocalSearchParameters, optional
    """
    assert search.best is not None
    clock = Clock(search, until_s, search.iteration + iterations)
    if search.best.evaluation.served_makespan == 0:  # no task that takes time can be served
        search.submit(Allocation.idle(search.instance))
        return
    if clock.is_over:
        return
    parameters = parameters or LocalSearchParameters()
    energy_counts = search.objective is Objective.MAKESPAN_ENERGY
    if clock.is_endless and energy_counts:
        _improve_endlessly(search, parameters, clock)
        return
    state = AnnealingState(search.instance, search.seed, parameters.neighbours)
    if energy_counts:
        reduce_makespan(search, state, parameters, clock.part(parameters.makespan_share), patience=PATIENCE)
    else:
        reduce_makespan(search, state, parameters, clock)
    if energy_counts and clock.is_long:
        reduce_energy(search, state, parameters, clock.part(FIRST_CYCLE_SHARE))
    if energy_counts:
        reduce_energy(search, state, parameters, clock)


def _improve_endlessly(search: Search, parameters: LocalSearchParameters, clock: Clock) -> None:
    """Alternate between makespan and energy, each turn twice as long as the one before."""
    state = AnnealingState(search.instance, search.seed, parameters.neighbours)
    cycle = parameters.first_cycle
    while not clock.is_over:
        reduce_makespan(search, state, parameters, Clock(search, until_iteration=search.iteration + cycle))
        reduce_energy(search, state, parameters, Clock(search, until_iteration=search.iteration + cycle))
        cycle *= 2


def reduce_makespan(
    search: Search,
    state: AnnealingState,
    parameters: LocalSearchParameters,
    clock: Clock,
    *,
    patience: float | None = None,
) -> None:
    """Attempt target makespans between the lower bound and the best, closer to the best after each failure.

    With `patience`, ends early when the last improvement was that many times as long ago as it took, but not in the
    first `LEAST_SHARE` of the clock.
    """
    assert search.fastest is not None
    state.begin(search.fastest.allocation, search.fastest.evaluation.served_makespan)
    iterations, fraction, attempts, improved = float(parameters.attempt_iterations), 0.0, 0, 0.0
    while not clock.is_over and not search.fast_enough:
        fastest = search.fastest.evaluation
        best = fastest.served_makespan
        bound = min(search.lower_bound, best) if fastest.makespan is not None else 0.5 * best
        if bound >= best * (1 - RELATIVE_TOLERANCE):
            return
        if patience is not None and clock.progress > max(LEAST_SHARE, (1 + patience) * improved):
            return
        initial = parameters.attempt_noise[attempts % len(parameters.attempt_noise)]
        noise = state.mean_ability * np.geomspace(initial, parameters.attempt_final_noise, int(iterations) + 1)[1:]
        reached = _attempt(search, state, clock, bound + fraction * (best - bound), noise, parameters.exchanges)
        fraction = 0.5 * fraction if reached else min(0.5 * (1 + fraction), 0.999)
        iterations *= 1.0 if reached else parameters.attempt_growth
        attempts += 1
        if search.fastest.evaluation.served_makespan < best:
            improved = clock.progress


def _attempt(
    search: Search, state: AnnealingState, clock: Clock, makespan: float, noise: FloatArray, exchanges: int
) -> bool:
    """Look for a plan within a target makespan, with the noise of each iteration; return whether one was found."""
    assert search.fastest is not None
    state.set_target(makespan)
    for level in noise.tolist():
        if clock.is_over or not state.n_short:
            break
        state.run(exchanges, state.weights(0.0, level, 0.0, 1.0))
        search.iteration += 1
    fastest = search.fastest.evaluation.served_makespan
    # where travel takes time, only the evaluation knows the makespan
    if not state.n_short or not state.arrays.instant_travel or state.current_makespan < fastest:
        search.submit(state.allocation)
    return not state.n_short


def reduce_energy(search: Search, state: AnnealingState, parameters: LocalSearchParameters, clock: Clock) -> None:
    """Anneal within the makespan of the best plan; what is left of the budget is one cooling cycle."""
    best = search.best
    assert best is not None
    if clock.is_over or best.evaluation.cost == 0:
        return
    plan = _plan_in_force(search)
    state.begin(
        best.allocation if plan is None else _serving(plan, best.allocation, search.instance.m), search.makespan_limit
    )
    clock = Clock(search, clock.until_s, clock.until_iteration)
    report = _Reporter(search, state)
    final = parameters.final_noise
    state.run(parameters.exchanges, parameters.weights(state, final, HARD))  # measures the pace
    search.iteration += 1
    exchanges = parameters.exchanges * clock.iterations_left / search.instance.n
    initial = parameters.initial_noise if plan is None else MOVES_NOISE
    initial *= parameters.noise_reduction(exchanges)
    while not clock.is_over:
        progress = clock.progress
        noise = initial * (final / initial) ** progress
        is_hard = initial <= final * 1.001 or progress > HARD_FROM
        state.run(parameters.exchanges, parameters.weights(state, noise, HARD if is_hard else 1.0))
        search.iteration += 1
        report()
    report(at_once=True)


class _Reporter:
    """Submits the best plan of an annealing state, at intervals that keep the time for scoring small."""

    def __init__(self, search: Search, state: AnnealingState) -> None:
        self.search, self.state = search, state
        self.submitted_cost, self.next_s = np.inf, 0.0

    def __call__(self, *, at_once: bool = False) -> None:
        """Submit the best plan if it is new, and if it is time to or `at_once`."""
        is_new = self.state.best_cost < self.submitted_cost
        if not is_new or not (at_once or time.monotonic() >= self.next_s):
            return
        begin = time.monotonic()
        self.submitted_cost = self.state.best_cost
        found = self.state.best
        if found is not None:
            self.search.submit(found)
        self.next_s = time.monotonic() + REPORT_INTERVAL * (time.monotonic() - begin)


def repair(search: Search, *, seconds: float) -> None:
    """Submit plans that keep to the makespan limit and are as near as possible to the plan in force.

    Parameters
    ----------
    search : Search
        Its instance has a price on moves, and its best plan serves the tasks that are to be served.
    seconds : float
        Time for it; at most `REPAIRS_PER_AGENT` are made.
    """
    plan, best, parameters = _plan_in_force(search), search.best, LocalSearchParameters()
    assert plan is not None
    assert best is not None
    if best.evaluation.cost == 0 or best.evaluation.served_makespan == 0:
        return
    state = AnnealingState(search.instance, search.seed, parameters.neighbours)
    state.begin(_serving(plan, best.allocation, search.instance.m), search.makespan_limit)
    begin, most = time.monotonic(), 1 + REPAIRS_PER_AGENT * search.instance.n // parameters.exchanges
    for count in range(most):
        progress = max(count / most, (time.monotonic() - begin) / seconds)
        if search.interrupted or progress >= 1:
            break
        noise = MOVES_NOISE * (parameters.final_noise / MOVES_NOISE) ** progress
        state.run(parameters.exchanges, parameters.weights(state, noise, HARD if progress > HARD_FROM else 1.0))
    if state.best is not None:
        search.submit(state.best)


def _plan_in_force(search: Search) -> Allocation | None:
    """Return the plan from which moves have a price, None where they have none."""
    move, origin = search.instance.reach.move, search.instance.reach.origin
    return None if move is None else only_allowed(search.instance, Allocation(move.task[origin]))


def _serving(plan: Allocation, other: Allocation, m: int) -> Allocation:
    """Return a plan that serves all tasks that another one does, with its agents where `plan` has none."""
    task: IntArray = plan.task_of_agent.copy()
    served = np.isin(np.arange(m), task)
    wanted = other.task_of_agent
    taken = (wanted != IDLE) & ~served[wanted]
    task[taken] = wanted[taken]
    return Allocation(task)
