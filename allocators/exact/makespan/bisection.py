"""The makespan stage: quick plans and bounds, then a bisection on T."""

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
"""Time shares of repartitions, configurations and local search, which alternate before the solver runs."""

PROBE_SHARE = 0.1
"""Time share of a probe, and of the search for plans after a probe without verdict."""


def least_makespan(
    search: Search, solver: Solver, min_served: int, until_s: float, patience: float = np.inf, *, descent: bool
) -> bool:
    """Narrow the gap between plans and bounds until it is closed or time is up, and submit both to `search`.

    Parameters
    ----------
    search : Search
        The run, which must have a plan.
    solver : Solver
    min_served : int
        Number of tasks to be served.
    until_s : float
        Seconds since the run began at which this must end.
    patience : float
        Time without a faster plan, as a multiple of the time until the fastest was found, after which the stage ends.
    descent : bool
        Whether to search for plans before the solver runs.

    Returns
    -------
    bool
        Whether more time would be of no use.
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
    """Improve plans and bounds by turns; they often meet, so that no solver is needed."""
    for plans, bounds, local in SHARES if state.descent and len(state.model.class_of_pair) > FEW_PAIRS else ():
        state.search_locally(local)
        search_repartitions(state, plans + (1 - state.local_weight) * local)
        raise_bound_by_configurations(state, bounds)


def bisect(state: MakespanState, solver: Solver) -> None:
    """Probe a sequence of T between the proven bound and the fastest plan.

    The lower bound is probed first, as it is often optimal. A probe without verdict raises the lower end of the
    bisection but proves nothing; it is repeated with more time once no other probe is left.
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
    """Return the next probe, given the verdict on the last one."""
    upper, floor, seconds = state.upper, max(state.lower, state.unresolved), state.share_s(PROBE_SHARE)
    if state.would_prove(floor) and state.unresolved > state.lower:
        state.unresolved = 0.0
        return Probe(upper * (1 - 0.9 * PROVEN), np.inf, Purpose.LAST)
    if state.would_prove(floor) or (last is Verdict.INFEASIBLE and not state.bounds_tried):
        return Probe(upper * (1 - TIGHT / 2), seconds, Purpose.BELOW_PLAN)
    middle = float(np.sqrt(floor * upper)) if upper > 2 * floor else (floor + upper) / 2
    return Probe(middle, seconds)
