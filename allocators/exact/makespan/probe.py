"""Probes: deciding whether there is a plan with makespan T."""

from dataclasses import dataclass
from enum import Enum

from alloc.allocators.exact.demand import Demand
from alloc.allocators.exact.makespan.lower_bounds import probe_by_groups
from alloc.allocators.exact.makespan.quick_plans import find_plan
from alloc.allocators.exact.makespan.state import MakespanState
from alloc.allocators.exact.monitor import SolverMonitor
from alloc.allocators.exact.solver_model import Solver, SolverLimits, SolverModel, Verdict

SOLVER_PART = 0.5
"""Share of a probe's time that the solver gets after the group enumeration has used all of it."""


class Purpose(Enum):
    """Purpose of a probe."""

    BISECT = "bisect"
    """Halve the gap; without a verdict, T becomes the lower end of the bisection."""

    BELOW_PLAN = "below the plan"
    """Check early, by a T just below the fastest plan, whether that is optimal; a missing verdict has no effect."""

    LAST = "last"
    """Use the remaining time once all other probes have ended without a verdict."""


@dataclass(frozen=True)
class Probe:
    """A makespan T in hours, the time limit of its probe in seconds, and the purpose."""

    time: float
    seconds: float
    purpose: Purpose = Purpose.BISECT


def probe_makespan(state: MakespanState, solver: Solver, probe: Probe) -> Verdict:
    """Search for a plan with makespan T or a proof that there is none, by increasingly expensive means."""
    demand = state.model.at(probe.time)
    if demand.trivially_infeasible:
        state.rule_out(probe.time)
        return Verdict.INFEASIBLE
    if state.bounds_tried:
        if state.descent and find_plan(state, probe.time):
            return Verdict.FEASIBLE
        verdict = probe_by_groups(state, probe.time, probe.seconds)
        if verdict is not Verdict.UNKNOWN or _building_s(state, solver) > SOLVER_PART * probe.seconds:
            return verdict
    return _probe_by_solver(state, solver, demand, probe)


def _building_s(state: MakespanState, solver: Solver) -> float:
    """Return the seconds for building the solver's model; shorter probes do without the solver."""
    return 2 * len(state.model.class_of_pair) / solver.pairs_per_second


def _probe_by_solver(state: MakespanState, solver: Solver, demand: Demand, probe: Probe) -> Verdict:
    search = state.search
    until_s = min(search.elapsed_s + SOLVER_PART * probe.seconds + _building_s(state, solver), state.until_s)
    model = SolverModel(
        demand=demand,
        cost=None,
        hint=state.model.counts(demand, state.plan),
        limits=SolverLimits.of(search, until_s - search.elapsed_s, search.threads),
    )

    def meanwhile() -> bool:
        """Return whether the parallel local search has found a plan for this T."""
        if state.local_search is not None:
            state.local_search.exchange()
        return state.upper <= probe.time or state.closed

    answer = solver.solve_model(model, SolverMonitor(search, state.model, demand, until_s, meanwhile))
    search.iteration += 1
    if answer.counts is not None:
        return state.verdict_on(state.model.allocation(demand, answer.counts), probe.time)
    if answer.verdict is Verdict.INFEASIBLE:
        state.rule_out(probe.time)
    return answer.verdict
