"""Improvement of a plan by annealing: first its makespan, then its energy; or repair of a plan in force."""

import math
import time

import numpy as np

from alloc.allocators.contract.clock import Clock
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.annealing_state import AnnealingState, PenaltyFactor
from alloc.allocators.heuristic.local_search.parameters import LocalSearchParameters
from alloc.allocators.heuristic.local_search.parts import MAX_STATES, Attempt, Parts, Team, tighten
from alloc.allocators.heuristic.task_prices.start import PricedPlan
from alloc.allocators.parallel.pool import thread_map
from alloc.problems import IDLE, Allocation, Objective, only_allowed
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import IntArray

HARD = 100.0
"""Factor on penalties with which they outweigh any distance."""

HARD_FROM = 0.95
"""Share of the budget after which no shortfall is accepted."""

FIRST_CYCLE_SHARE = 0.1
"""Share of a long budget for a first annealing cycle, so that a run that is stopped early has a good plan."""

PATIENCE, MIN_SHARE = 3.0, 0.2
"""The search for less makespan ends if the time since the last improvement is this multiple of the time before it, but
not before this share of its time has passed."""

EXCHANGES_PER_TASK = 20.0
"""Minimum number of exchanges per task in an attempt."""

REPORT_INTERVAL = 20.0
"""Time between two reports, as a multiple of the time for scoring a plan."""

REPORT_ITERATIONS, AGENTS_PER_ITERATION = 20, 500
"""Least iterations between two reports without a time limit, and agents per iteration if that gives more."""

MOVES_NOISE = 1.0
"""Initial noise if moves have a price, relative to the mean cost; it is high, as nearly all moves cost the same."""

REPAIRS_PER_AGENT = 400
"""Maximum number of exchanges per agent in a repair."""


def improve(
    search: Search,
    *,
    until_s: float = math.inf,
    iterations: float = math.inf,
    priced: PricedPlan | None = None,
    parameters: LocalSearchParameters | None = None,
) -> None:
    """Improve ``search.best``, which must exist, and submit better plans until the search or a limit ends.

    Parameters
    ----------
    search : Search
        The run; its best plan is the initial one.
    until_s : float
        Value of ``search.elapsed_s`` at which to end.
    iterations : float
        Maximum number of iterations of ``parameters.exchanges`` exchanges each.
    priced : PricedPlan, optional
        A plan from prices of tasks, from which the search for less makespan begins; see `tighten`.
    parameters : LocalSearchParameters, optional
    """
    assert search.best is not None
    clock = Clock(search, until_s, search.iteration + iterations)
    if search.best.evaluation.served_makespan == 0:  # no task with workload can be served
        search.submit(Allocation.idle(search.instance))
        return
    if clock.is_over:
        return
    parameters = parameters or LocalSearchParameters()
    with thread_map(min(search.threads, MAX_STATES)) as run_all:
        _improve(search, Team.of(search, parameters.neighbours, run_all), parameters, clock, priced)


def _improve(
    search: Search, team: Team, parameters: LocalSearchParameters, clock: Clock, priced: PricedPlan | None
) -> None:
    energy_counts = search.objective is Objective.MAKESPAN_ENERGY
    makespan_clock = clock.part(parameters.makespan_share) if energy_counts and not clock.is_endless else clock
    if priced is not None:
        tighten(search, team, priced, makespan_clock, parameters.exchanges)
    if clock.is_endless and energy_counts:
        _improve_endlessly(search, team, parameters, clock)
        return
    reduction = MakespanReduction(search, team, parameters)
    if not energy_counts:
        reduction.run(clock)
        return
    reduction.run(makespan_clock, patience=PATIENCE)
    if clock.is_long:
        reduce_energy(search, team, parameters, clock.part(FIRST_CYCLE_SHARE))
    reduce_energy(search, team, parameters, clock)


def _improve_endlessly(search: Search, team: Team, parameters: LocalSearchParameters, clock: Clock) -> None:
    """Alternate between makespan and energy in cycles of doubling length."""
    cycle = parameters.first_cycle
    while not clock.is_over:
        MakespanReduction(search, team, parameters).run(Clock(search, until_iteration=search.iteration + cycle))
        reduce_energy(search, team, parameters, Clock(search, until_iteration=search.iteration + cycle))
        cycle *= 2


class MakespanReduction:
    """Attempts at target makespans between the lower bound and the best plan, closer to the best after each failure.

    Several threads make the next attempts speculatively, assuming that all earlier ones fail, as most do.

    Parameters
    ----------
    search : Search
        A run that has a plan.
    team : Team
    parameters : LocalSearchParameters
    """

    def __init__(self, search: Search, team: Team, parameters: LocalSearchParameters) -> None:
        self._search, self._team, self._parameters = search, team, parameters
        by_size = EXCHANGES_PER_TASK * search.instance.m / parameters.exchanges
        self._first_iterations = max(float(parameters.attempt_iterations), by_size)
        self._iterations, self._fraction, self._count = self._first_iterations, 0.0, 0
        self._known: Allocation | None = None

    def run(self, clock: Clock, *, patience: float | None = None) -> None:
        """Continue until the clock ends, from the end of the last run or from a better plan found elsewhere.

        With `patience`, ends early when the time since the last improvement is that multiple of the time before it, but
        not in the first `MIN_SHARE` of the clock.
        """
        search, improved = self._search, 0.0
        assert search.fastest is not None
        if search.fastest.allocation is not self._known:
            for state in self._team.states:
                state.begin(search.fastest.allocation, search.fastest.evaluation.served_makespan)
            self._iterations, self._fraction = self._first_iterations, 0.0
        while not clock.is_over and not search.fast_enough:
            fastest = search.fastest.evaluation
            best = fastest.served_makespan
            bound = min(search.lower_bound, best) if fastest.makespan is not None else 0.5 * best
            has_waited = patience is not None and clock.progress > max(MIN_SHARE, (1 + patience) * improved)
            if has_waited or bound >= best * (1 - RELATIVE_TOLERANCE):
                return
            self._attempt(clock, bound, best)
            if search.fastest.evaluation.served_makespan < best:
                improved = clock.progress
        self._known = search.fastest.allocation

    def _attempt(self, clock: Clock, bound: float, best: float) -> None:
        """Make one attempt in each thread, and choose the target of the next ones."""
        attempts = [self._next_attempt(number, clock, bound, best) for number in range(len(self._team.states))]
        for attempt in self._team.run_all(lambda one: one.run(clock, self._parameters.exchanges), attempts):
            self._search.iteration += attempt.done
            attempt.submit(self._search)
        self._count += len(attempts)
        for attempt in attempts:
            if attempt.is_reached:
                self._fraction, self._iterations = 0.5 * attempt.fraction, attempt.iterations
                break

    def _next_attempt(self, number: int, clock: Clock, bound: float, best: float) -> Attempt:
        parameters, state = self._parameters, self._team.states[number]
        initial = parameters.attempt_noise[(self._count + number) % len(parameters.attempt_noise)]
        levels = np.geomspace(initial, parameters.attempt_final_noise, int(self._iterations) + 1)[1:]
        most = int(min(clock.iterations_of(number, len(self._team.states)), len(levels)))
        makespan = bound + self._fraction * (best - bound)
        attempt = Attempt(state, self._fraction, makespan, state.mean_ability * levels[:most], self._iterations)
        self._fraction = min(0.5 * (1 + self._fraction), 0.999)
        self._iterations *= parameters.attempt_growth
        return attempt


def reduce_energy(search: Search, team: Team, parameters: LocalSearchParameters, clock: Clock) -> None:
    """Anneal within the makespan of the best plan, in one cooling cycle over the rest of the budget."""
    best, state = search.best, team.states[0]
    assert best is not None
    if clock.is_over or best.evaluation.cost == 0:
        return
    plan = _plan_in_force(search)
    start = best.allocation if plan is None else _serving(plan, best.allocation, search.instance.m)
    state.begin(start, search.makespan_limit)
    clock = Clock(search, clock.until_s, clock.until_iteration)
    report, parts = _Reporter(search, state), Parts(team, search.seed)
    final = parameters.final_noise
    # measures the pace
    search.iteration += parts.run(parts.count, parameters.exchanges, parameters.weights(state, final, HARD))
    exchanges = parameters.exchanges * clock.iterations_left / search.instance.n
    initial = parameters.initial_noise if plan is None else MOVES_NOISE
    initial *= parameters.noise_reduction(exchanges)
    factor = PenaltyFactor(state, parameters.exchanges, exchanges)
    while not clock.is_over:
        progress = clock.progress
        noise = initial * (final / initial) ** progress
        is_hard = initial <= final * 1.001 or progress > HARD_FROM
        weights = parameters.weights(state, noise, HARD if is_hard else factor.value)
        made = parts.run(clock.until_iteration - search.iteration, parameters.exchanges, weights)
        search.iteration += made
        factor.update(made)
        report()
    report(at_once=True)


class _Reporter:
    """Submits the best plan of an annealing state, at intervals that keep the time for scoring small.

    Submitting may change the fastest plan, so without a time limit the intervals are counted in iterations, so that
    runs are reproducible.
    """

    def __init__(self, search: Search, state: AnnealingState) -> None:
        self.search, self.state = search, state
        self.submitted_cost, self.next_s, self.next_iteration = np.inf, 0.0, 0

    def __call__(self, *, at_once: bool = False) -> None:
        """Submit the best plan if it is new, and a report is due or `at_once` is set."""
        if self.state.best_cost >= self.submitted_cost or not (at_once or self._is_due()):
            return
        begin = time.monotonic()
        self.submitted_cost = self.state.best_cost
        found = self.state.best
        if found is not None:
            self.search.submit(found)
        self.next_s = time.monotonic() + REPORT_INTERVAL * (time.monotonic() - begin)
        wait = max(REPORT_ITERATIONS, self.search.instance.n // AGENTS_PER_ITERATION)
        self.next_iteration = self.search.iteration + wait

    def _is_due(self) -> bool:
        if self.search.budget.time_limit_s is None:
            return self.search.iteration >= self.next_iteration
        return time.monotonic() >= self.next_s


def repair(search: Search, *, seconds: float) -> None:
    """Submit plans within the makespan limit that are as close as possible to the plan in force.

    Parameters
    ----------
    search : Search
        A run on an instance with a price on moves, whose best plan serves all tasks that can be served.
    seconds : float
        Time limit; at most `REPAIRS_PER_AGENT` exchanges per agent are made.
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
    """Return the plan in force, from which moves have a price; None if they have none."""
    move, origin = search.instance.reach.move, search.instance.reach.origin
    return None if move is None else only_allowed(search.instance, Allocation(move.task[origin]))


def _serving(plan: Allocation, other: Allocation, m: int) -> Allocation:
    """Return `plan` with the agents of `other` on those tasks that only `other` serves."""
    task: IntArray = plan.task_of_agent.copy()
    served = np.isin(np.arange(m), task)
    wanted = other.task_of_agent
    taken = (wanted != IDLE) & ~served[wanted]
    task[taken] = wanted[taken]
    return Allocation(task)
