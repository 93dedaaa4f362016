"""The least makespan: quick plans and bounds, then a bisection on T."""

import numpy as np

from alloc.allocators.contract.search import Search
from alloc.allocators.contract.tolerance import PROVEN
from alloc.allocators.exact.makespan.lower_bounds import raise_bound_by_configurations, raise_bound_by_relaxation
from alloc.allocators.exact.makespan.probe import Probe, Purpose, probe_makespan
from alloc.allocators.exact.makespan.quick_plans import descend_in_steps, search_repartitions
from alloc.allocators.exact.makespan.state import TIGHT, MakespanState
from alloc.allocators.exact.model import FEW_PAIRS
from alloc.allocators.exact.solver_model import Solver, Verdict

SHARES = ((0.02, 0.02, 0.03), (0.07, 0.05, 0.08), (0.2, 0.15, 0.2))
"""Shares of the time of repartitions, configurations and local search, which take turns before the solver."""

PROBE_SHARE = 0.1
"""Share of the time of a probe; as much goes to plans after one that stayed open."""


def least_makespan(
    search: Search, solver: Solver, min_served: int, until_s: float, patience: float = np.inf, *, descent: bool
) -> bool:
    """Narrow the gap between plans and bounds until it is closed or time is up; both go to `search`.

    Parameters
    ----------
    search : Search
        There is a plan already.
    solver : Solver
    min_served : int
        How many tasks are to be served.
    until_s : float
        Seconds since the run began at which this must end.
    patience : float
        Time without a faster plan, as a multiple of the time until the fastest was found, after which this ends.
    descent : bool
        Whether plans are looked for without the solver first.

    Returns
    -------
    bool
        Whether more time would not help.
    """
    state = MakespanState.begin(search, min_served, until_s, patience, descent=descent)
    is_plain = search.instance.reach.is_complete and state.model.unit is not None
    if descent and (is_plain or not state.repartition.is_tractable):
        descend_in_steps(state)
    raise_bound_by_relaxation(state)
    if not state.ended:
        with state.with_local_search():
            take_turns(state)
            bisect(state, solver)
    return state.closed or not state.over


def take_turns(state: MakespanState) -> None:
    """Find plans and bounds that often meet, so that no solver is needed."""
    for plans, bounds, local in SHARES if state.descent and len(state.model.class_of_pair) > FEW_PAIRS else ():
        state.search_locally(local)
        search_repartitions(state, plans + (1 - state.local_weight) * local)
        raise_bound_by_configurations(state, bounds)


def bisect(state: MakespanState, solver: Solver) -> None:
    """Probe one T after the other between the proven bound and the fastest plan.

    The lower bound is probed first, as it is often the optimum. A probe without a verdict raises the lower end of the
    bisection but proves nothing; it is repeated with more time once nothing else is left.
    """
    probe = Probe(state.lower, state.share_s(PROBE_SHARE))
    while not state.ended:
        verdict = probe_makespan(state, solver, probe)
        if verdict is Verdict.UNKNOWN:
            if probe.purpose is Purpose.LAST or state.would_prove(state.lower):
                return
            if probe.purpose is Purpose.BISECT:
                state.unresolved = max(state.unresolved, state.model.next_makespan(probe.time))
            if not state.bounds_tried:
                raise_bound_by_configurations(state, 2 * PROBE_SHARE)
            if state.descent:
                search_repartitions(state, PROBE_SHARE * (1.5 - state.local_weight / 2))
                state.search_locally(PROBE_SHARE / 2)
                raise_bound_by_configurations(state, PROBE_SHARE / 2)
        probe = _next_probe(state, verdict)


def _next_probe(state: MakespanState, last: Verdict) -> Probe:
    """Choose the next T, given the verdict on the last one."""
    upper, floor, seconds = state.upper, max(state.lower, state.unresolved), state.share_s(PROBE_SHARE)
    if state.would_prove(floor) and state.unresolved > state.lower:
        state.unresolved = 0.0
        return Probe(upper * (1 - 0.9 * PROVEN), np.inf, Purpose.LAST)
    if state.would_prove(floor) or (last is Verdict.INFEASIBLE and not state.bounds_tried):
        return Probe(upper * (1 - TIGHT / 2), seconds, Purpose.BELOW_PLAN)
    middle = float(np.sqrt(floor * upper)) if upper > 2 * floor else (floor + upper) / 2
    return Probe(middle, seconds)
