"""The least energy at a makespan: agents alike to the nearest tasks, both sides of the gap, then the solver."""

import sys
from contextlib import nullcontext

from alloc.allocators.contract.search import Search
from alloc.allocators.exact.energy.cuts.group_programme import GroupProgramme
from alloc.allocators.exact.energy.places import nearest_places, without_idlers
from alloc.allocators.exact.energy.primal_dual import FEW_GROUPS, REPEATABLE_SLICES, PrimalDual
from alloc.allocators.exact.energy.state import STAGE_S, EnergyState
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.monitor import SolverMonitor, is_over
from alloc.allocators.exact.solver_model import Answer, Solver, SolverLimits, SolverModel
from alloc.allocators.parallel.pool import Pool
from alloc.problems import agent_classes
from alloc.problems.evaluation import last_equal

SHARE_WITHOUT_SOLVER = 0.3
"""Share of the time before which the solver does not run."""

SHARE_WITHOUT_GROUPS = 0.1
"""Share of the time before which groups are not counted, as better plans soon make them fewer."""

MOST_GROUPS = FEW_GROUPS, 15_000
"""Groups of tasks up to which, first and then, an integer programme picks among them where bounds rise no more."""

SOLVER_GAP = 1e-7
"""Relative gap that solvers leave by their tolerances."""

SMALL_PAIRS = 3000
"""Pairs of class and task that a better plan may have, up to which the solver comes next even if bounds still rise."""

LATER, MUCH_LATER, MIXING_SHARE, MOST_MIXED = 0.12, 0.3, 0.04, 1500
"""Parts of the time between two attempts to make a plan of groups found so far, after a better plan and else; part of
the time that an attempt takes, and groups in it, at the most."""

LOCAL_SHARE, LESS_SHARE, MAX_LOCAL_S = 0.7, 0.1, 30.0
"""Share of the time of local search where nothing else finds plans, and where an annealed search with prices does, and
seconds at the most."""

SHORT_STAGE_S = 0.6
"""Length of the stage up to which that search hardly begins, so that local search has its whole share."""

SHARE_WITH_PLANS = 0.85
"""Share of the time up to which that search goes on while it finds plans, unless pairs are too many for the solver."""


def least_energy(search: Search, solver: Solver, min_served: int) -> float | None:
    """Look for the least energy at the makespan of the best plan so far; return a lower bound on it.

    Parameters
    ----------
    search : Search
    solver : Solver
    min_served : int
        How many tasks are to be served.

    Returns
    -------
    float or None
        Energy that every plan with at most this makespan needs; None if nothing is known.
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
    """Close the gap from both sides, then by the solver; return what is proven to be needed, in units of distance."""
    both, search = state.primal_dual, state.search
    if state.local_search is not None:
        share = LOCAL_SHARE if state.travel is None or state.stage_s < SHORT_STAGE_S else LESS_SHARE
        state.local_search.turn(min(share * search.remaining_s, MAX_LOCAL_S))
        state.submit(None)
    if both is None:
        return _solve_rest(state, solver).bound
    groups = _close_gap(state, both)
    if state.travel is not None:
        state.travel.submit()
        state.submit(None)
    if both.closed or is_over(search):
        return both.bound
    bound = both.bound
    for most in MOST_GROUPS:
        if bound < state.cost * (1 - SOLVER_GAP) and not is_over(search):
            groups = groups or both.groups_of_cheapest(most)
            bound = bound if groups is None else max(bound, _solve_groups(state, both, groups))
            groups = None
    if bound < state.cost * (1 - SOLVER_GAP) and not is_over(search):
        bound = max(bound, _solve_rest(state, solver).bound)
    return min(max(bound, both.bound), state.cost)


def _close_gap(state: EnergyState, both: PrimalDual) -> GroupProgramme | None:
    """Work on both sides until better plans have few groups, or bounds hardly rise any more; return these groups."""
    search = state.search
    if state.repeatable:
        for number in range(REPEATABLE_SLICES):
            if both.closed or search.interrupted:
                return None
            state.submit(both.repeat(number))
        return None
    next_try = LATER
    with Pool(1) as pool:
        while not (is_over(search) or both.closed):
            progress = state.progress
            if progress >= next_try and state.travel is None:
                next_try = progress + (LATER if _mix_groups(state, both) else MUCH_LATER)
                continue
            is_ready = both.converged or (both.is_rising_slowly and len(both.keep) <= SMALL_PAIRS)
            groups = None if progress < SHARE_WITHOUT_GROUPS else both.few_groups()
            is_ready = is_ready and progress >= SHARE_WITHOUT_SOLVER and not _finds_plans(state, both)
            if groups is not None or progress >= 1 or is_ready:
                return groups
            state.submit(both.run(min(1.0, progress), pool if state.spare_threads else None))
    return None


def _mix_groups(state: EnergyState, both: PrimalDual) -> bool:
    """Look for a better plan among the groups that prices have brought up; return whether there was one."""
    search, before = state.search, state.cost
    groups = both.known_groups(MOST_MIXED)
    if groups is None:
        return False
    monitor = SolverMonitor(search, state.model, state.demand, state.until_s)
    seconds = MIXING_SHARE * min(STAGE_S, state.until_s - state.begin_s)
    counts, _ = groups.solve(monitor, search.seed, repeatable=False, seconds=seconds)
    search.iteration += 1
    if counts is not None:
        search.submit(both.allocation(groups, counts))
        state.submit(None)
    return state.cost < before * (1 - SOLVER_GAP)


def _finds_plans(state: EnergyState, both: PrimalDual) -> bool:
    """Whether the annealed search is to go on: for the solver there are too many pairs, or plans still get better."""
    if state.travel is None or len(both.keep) > SMALL_PAIRS:
        return state.travel is not None
    return state.progress < SHARE_WITH_PLANS and not state.travel.has_stalled(state.stage_s)


def _solve_groups(state: EnergyState, both: PrimalDual, groups: GroupProgramme) -> float:
    """Pick the best of the groups that a better plan may have; return a bound."""
    search = state.search
    monitor = SolverMonitor(search, state.model, state.demand, state.until_s)
    counts, bound = groups.solve(monitor, search.seed, repeatable=state.repeatable)
    search.iteration += 1
    if counts is not None:
        search.submit(both.allocation(groups, counts))
    return bound


def _solve_rest(state: EnergyState, solver: Solver) -> Answer:
    """Give the solver the pairs that a better plan may have; with two threads or more, both sides go on meanwhile."""
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
