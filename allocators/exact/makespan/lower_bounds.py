"""Lower bounds without the solver: by configurations, by enumeration of groups, and by fractional agents."""

from alloc.allocators.exact.makespan.ascent import ConfigurationAscent
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.enumeration import enumerate_groups
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.makespan.set_partitioning import solve_set_partitioning
from alloc.allocators.exact.makespan.state import MakespanState
from alloc.allocators.exact.solver_model import Verdict

FIRST_ASCENT, ASCENT = 0.05, 0.5
"""Time share of the first ascent, usually enough for prices that guide the search for plans, and the share of the time
for bounds that later ascents take, as they soon gain little."""

MIN_ASCENT_S = 0.05
"""Minimum duration of an ascent in seconds."""

REPEATABLE_ROUNDS = 60
"""Rounds of one ascent in repeatable runs."""


def raise_bound_by_configurations(state: MakespanState, share: float) -> None:
    """Raise the lower bound by the configuration linear programme, unless it is too large."""
    first, state.bounds_tried = not state.bounds_tried, True
    if state.ended or state.partial:
        return
    if state.model.travel_time is not None:
        _ascend(state, state.search.elapsed_s + state.share_s(ASCENT * share, MIN_ASCENT_S))
        return
    if first:
        configurations = ConfigurationProgramme(state.model, state.lower)
        state.configurations = configurations if configurations.is_tractable else None
    until_s = state.search.elapsed_s + state.share_s(share)
    while not state.bounds_converged and state.configurations is not None:
        if not _bisect_by_prices(state, state.configurations, until_s):
            return
        finer = state.configurations.refined(state.lower)
        state.configurations, state.bounds_converged = finer or state.configurations, finer is None


def raise_bound_by_relaxation(state: MakespanState) -> None:
    """Raise the lower bound by the relaxation with fractional agents, if reach or travel times are limited.

    If travel takes time, prices for integer agents raise the bound sooner than linear programmes.
    """
    instance = state.search.instance
    if state.ended or state.partial or not (instance.has_travel_time or not instance.reach.is_complete):
        return
    if instance.has_travel_time:
        state.ascent = ConfigurationAscent(state.model, state.lower)
        if state.ascent.is_tractable:
            _ascend(state, state.search.elapsed_s + state.share_s(FIRST_ASCENT, MIN_ASCENT_S))
            return
    bound, state.price = relaxed_lower_bound(
        state.model, state.lower, state.upper, state.share_s(0.2), lambda: state.over
    )
    if bound > state.lower:
        state.rule_out_below(bound)


def probe_by_groups(state: MakespanState, time: float, seconds: float) -> Verdict:
    """Search for groups that form a plan with makespan `time`, or prove that there are none."""
    configurations = state.configurations
    if configurations is None:
        return Verdict.UNKNOWN
    until_s = min(state.search.elapsed_s + seconds, state.until_s)

    def over() -> bool:
        return state.over or state.search.elapsed_s >= until_s

    prices = configurations.dual_prices(time, over, converge=True)
    if prices is None:
        return Verdict.UNKNOWN
    if prices.theta > 1:
        state.rule_out(configurations.largest_infeasible(prices, time, state.upper))
        return Verdict.INFEASIBLE
    programme = enumerate_groups(configurations, prices, time, over)
    if programme is None or over():
        return Verdict.UNKNOWN
    verdict, table = solve_set_partitioning(programme, state.search.seed, over)
    if table is not None:
        return state.verdict_on(state.model.plan(table), time)
    if verdict is Verdict.INFEASIBLE:
        state.rule_out(time)
    return verdict


def _ascend(state: MakespanState, until_s: float) -> None:
    """Raise the lower bound by the subgradient method, with a separate knapsack for each task."""
    if state.ascent is None or not state.ascent.is_tractable:
        return
    rounds = 0
    while not (state.ended or state.ascent.converged or state.search.elapsed_s >= until_s):
        if state.ascent.round(state.lower):
            state.rule_out(state.ascent.proven)
        rounds += 1
        if state.repeatable and rounds >= REPEATABLE_ROUNDS:
            break
    state.price = state.ascent.task_price


def _bisect_by_prices(state: MakespanState, configurations: ConfigurationProgramme, until_s: float) -> bool:
    """Bisect on T between the bound and the least T not excluded by dual prices; return whether that finished."""
    time, possible = state.lower, state.upper
    while not state.ended and possible > state.lower * (1 + configurations.precision):
        prices = configurations.dual_prices(time, lambda: state.over or state.search.elapsed_s > until_s)
        if prices is None or not (prices.converged or prices.theta > 1):
            return False
        if prices.theta > 1:
            state.rule_out(configurations.largest_infeasible(prices, time, possible))
        else:
            possible = max(state.lower, state.model.earliest_with_same_needs(time))
        time = (state.lower + min(possible, state.upper)) / 2
    return not state.ended
