"""The energy stage: exchanges of identical agents, plans and bounds by turns, then the solver."""

import sys
from contextlib import nullcontext

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy.cuts.group_programme import GroupProgramme
from alloc.allocators.exact.energy.neighbourhood import InducedSearch
from alloc.allocators.exact.energy.places import nearest_places, without_idlers
from alloc.allocators.exact.energy.primal_dual import FEW_GROUPS, REPEATABLE_SLICES, PrimalDual
from alloc.allocators.exact.energy.state import EnergyState
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.monitor import SolverMonitor, is_over
from alloc.allocators.exact.solver_model import Answer, Solver, SolverLimits, SolverModel
from alloc.allocators.parallel.pool import Pool
from alloc.problems import agent_classes
from alloc.problems.evaluation import last_equal

SHARE_WITHOUT_SOLVER = 0.3
"""Share of the time before the solver may run."""

SHARE_WITHOUT_GROUPS = 0.1
"""Share of the time before groups are counted, as better plans soon reduce their number."""

MAX_GROUPS = FEW_GROUPS, 15_000
"""Numbers of groups, tried in turn, up to which an integer programme selects among them if bounds no longer rise."""

SOLVER_GAP = 1e-7
"""Relative gap left by solvers due to their tolerances."""

SMALL_PAIRS = 3000
"""Number of pairs that a better plan may use, up to which the solver is called even if bounds still rise."""

LOCAL_SHARE, LESS_SHARE, MAX_LOCAL_S = 0.7, 0.1, 30.0
"""Time share of local search if nothing else finds plans, and if the annealing search with prices does; and its maximum
in seconds."""

SHORT_STAGE_S = 0.6
"""Length of the stage up to which the annealing search hardly starts, so that local search gets its full share."""

SHARE_WITH_PLANS = 0.85
"""Share of the time up to which the annealing search continues while it finds plans, if the solver is tractable."""


def least_energy(search: Search, solver: Solver, min_served: int) -> float | None:
    """Minimise the energy at the makespan of the best plan so far; return a lower bound on it.

    Parameters
    ----------
    search : Search
    solver : Solver
    min_served : int
        Number of tasks to be served.

    Returns
    -------
    float or None
        Lower bound on the energy of all plans with at most this makespan; None if unknown.
    """
    assert search.best is not None
    time = last_equal(search.makespan_limit)
    if search.best.evaluation.cost == 0:
        return 0.0
    if is_over(search):
        return None
    model = Model.build(search.instance, agent_classes(search.instance, by_place=True), min_served)
    search.submit(nearest_places(search.instance, search.best.allocation, lambda: is_over(search)))
    search.submit(without_idlers(model, search.best.allocation, time))
    state = EnergyState.begin(search, model, model.at(time))
    with nullcontext() if state.local_search is None else state.local_search:
        cost = _least_cost(state, solver)
    return min(max(0.0, cost * search.instance.reach.energy_per_distance), sys.float_info.max)


def _least_cost(state: EnergyState, solver: Solver) -> float:
    """Close the gap from both sides, then by the solver; return the proven lower bound in units of distance."""
    both, search = state.primal_dual, state.search
    if state.local_search is not None:
        share = LOCAL_SHARE if state.travel is None or state.stage_s < SHORT_STAGE_S else LESS_SHARE
        state.local_search.turn(min(share * search.remaining_s, MAX_LOCAL_S))
        state.submit(None)
    if both is None:
        return _solve_rest(state, solver).bound
    groups = _close_gap(state, both, solver)
    if state.travel is not None:
        state.travel.submit()
        state.submit(None)
    if both.closed or is_over(search):
        return both.bound
    bound = both.bound
    for most in MAX_GROUPS:
        if bound < state.cost * (1 - SOLVER_GAP) and not is_over(search):
            groups = groups or both.groups_of_cheapest(most)
            bound = bound if groups is None else max(bound, _solve_groups(state, both, groups))
            groups = None
    if bound < state.cost * (1 - SOLVER_GAP) and not is_over(search):
        bound = max(bound, _solve_rest(state, solver).bound)
    return min(max(bound, both.bound), state.cost)


def _close_gap(state: EnergyState, both: PrimalDual, solver: Solver) -> GroupProgramme | None:
    """Improve plans and bounds until better plans have few groups, or bounds hardly rise; return the groups if few."""
    search = state.search
    if state.repeatable:
        for number in range(REPEATABLE_SLICES):
            if both.closed or search.interrupted:
                return None
            state.submit(both.repeat(number))
        return None
    induced = InducedSearch()
    with Pool(1) as pool:
        while not (is_over(search) or both.closed):
            progress = state.progress
            if induced.is_due(state):
                induced.turn(state, solver)
                continue
            is_ready = both.converged or (both.is_rising_slowly and len(both.keep) <= SMALL_PAIRS)
            groups = None if progress < SHARE_WITHOUT_GROUPS else both.few_groups()
            is_ready = is_ready and progress >= SHARE_WITHOUT_SOLVER and not _finds_plans(state, both)
            if groups is not None or progress >= 1 or is_ready:
                return groups
            state.submit(both.run(min(1.0, progress), pool if state.spare_threads else None))
    return None


def _finds_plans(state: EnergyState, both: PrimalDual) -> bool:
    """Whether to continue the annealing search: there are too many pairs for the solver, or plans still improve."""
    if state.travel is None or len(both.keep) > SMALL_PAIRS:
        return state.travel is not None
    return state.progress < SHARE_WITH_PLANS and not state.travel.has_stalled(state.stage_s)


def _solve_groups(state: EnergyState, both: PrimalDual, groups: GroupProgramme) -> float:
    """Select the best groups by an integer programme; return a lower bound."""
    search = state.search
    monitor = SolverMonitor(search, state.model, state.demand, state.until_s)
    counts, bound = groups.solve(monitor, search.seed, repeatable=state.repeatable)
    search.iteration += 1
    if counts is not None:
        search.submit(both.allocation(groups, counts))
    return bound


def _solve_rest(state: EnergyState, solver: Solver) -> Answer:
    """Run the solver on pairs that a better plan may use; with two threads or more, both sides continue meanwhile."""
    search, both, demand = state.search, state.primal_dual, state.demand
    assert search.best is not None
    if both is not None:
        demand = demand.only(both.keep)
    model = SolverModel(
        demand=demand,
        cost=state.model.cost[state.model.pairs_at(demand)],
        hint=state.model.counts(demand, search.best.allocation),
        limits=SolverLimits.of(search, search.remaining_s, max(1, state.spare_threads + (both is None))),
    )

    def meanwhile() -> bool:
        if state.repeatable:
            return False
        plan = None if both is None or not state.spare_threads else both.run(min(1.0, state.progress), None)
        state.submit(plan)
        return both is not None and both.closed

    answer = solver.solve_model(model, SolverMonitor(search, state.model, demand, state.until_s, meanwhile))
    search.iteration += 1
    if answer.counts is not None:
        search.submit(state.model.allocation(demand, answer.counts))
    return answer
