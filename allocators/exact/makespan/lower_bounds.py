"""Lower bounds without the solver: by configurations, by groups, and by fractions of agents."""

from alloc.allocators.exact.makespan.ascent import ConfigurationAscent
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.enumeration import enumerate_groups
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.makespan.set_partitioning import solve_set_partitioning
from alloc.allocators.exact.makespan.state import TIGHT, MakespanState
from alloc.allocators.exact.solver_model import Verdict

REPEATABLE_ROUNDS = 60
"""Rounds of one ascent where effort is counted."""


def raise_bound_by_configurations(state: MakespanState, share: float) -> None:
    """Raise the lower bound by the configuration linear programme, unless it is too large."""
    first, state.bounds_tried = not state.bounds_tried, True
    if state.ended or state.partial:
        return
    if state.model.travel_time is not None:
        _ascend(state, state.search.elapsed_s + state.share_s(share))
        return
    if first:
        configurations = ConfigurationProgramme(state.model, state.lower)
        state.configurations = configurations if configurations.is_tractable else None
    if state.configurations is not None:
        _bisect_by_prices(state, state.configurations, state.search.elapsed_s + state.share_s(share))


def raise_bound_by_relaxation(state: MakespanState) -> None:
    """Raise the lower bound by linear programmes of single agents, where not all agents can be everywhere at once."""
    instance = state.search.instance
    if state.ended or state.partial or not (instance.has_travel_time or not instance.reach.is_complete):
        return
    bound, state.price = relaxed_lower_bound(
        state.model, state.lower, state.upper, state.share_s(0.2), lambda: state.over
    )
    if bound > state.lower:
        state.rule_out_below(bound)


def probe_by_groups(state: MakespanState, time: float, seconds: float) -> Verdict:
    """Look for groups that make up a plan with makespan `time`, or prove that there are none."""
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
    """Raise the lower bound by a subgradient method, where each task has a knapsack of its own."""
    if state.ascent is None and state.price is not None:
        state.ascent = ConfigurationAscent(state.model, state.lower, state.price)
    if state.ascent is None or not state.ascent.is_tractable:
        return
    rounds = 0
    while not (state.ended or state.ascent.converged or state.search.elapsed_s >= until_s):
        if state.ascent.round(state.lower):
            state.rule_out(state.ascent.proven)
        rounds += 1
        if state.repeatable and rounds >= REPEATABLE_ROUNDS:
            return


def _bisect_by_prices(state: MakespanState, configurations: ConfigurationProgramme, until_s: float) -> None:
    """Bisect on T between the lower bound and the least T that dual prices do not exclude."""
    time, possible = state.lower, state.upper
    while not state.ended and possible > state.lower * (1 + TIGHT):
        prices = configurations.dual_prices(time, lambda: state.over or state.search.elapsed_s > until_s)
        if prices is None or not (prices.converged or prices.theta > 1):
            return
        if prices.theta > 1:
            state.rule_out(configurations.largest_infeasible(prices, time, possible))
        else:
            possible = max(state.lower, state.model.earliest_with_same_needs(time))
        time = (state.lower + min(possible, state.upper)) / 2
