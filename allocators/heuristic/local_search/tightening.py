"""Less makespan from a plan near the bound, in which few tasks lack a little for a lower target."""

from alloc.allocators.contract.clock import Clock
from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.local_search.parts import Team
from alloc.allocators.heuristic.task_prices.start import PricedPlan
from alloc.problems.evaluation import RELATIVE_TOLERANCE

PATIENCE_PER_TASK, LEAST_PATIENCE = 10.0, 10
"""Exchanges for each task, and least number of iterations, after which an attempt ends if no fewer tasks are short."""

MOST_FAILURES = 3
"""Rounds of attempts in a row without a success, after which other searches take over."""


def tighten(search: Search, team: Team, priced: PricedPlan, clock: Clock, exchanges: int) -> None:
    """Halve the gap of a plan from prices as often as exchanges without noise succeed; submit what they reach.

    Noise would undo what prices have settled. Each attempt begins at the plan of the last success; after a failure,
    the target is halfway to the fastest. Several threads try such targets ahead of time.

    Parameters
    ----------
    search : Search
        It has a plan.
    team : Team
    priced : PricedPlan
        Its prices are those of shortfalls in the beginning of each attempt.
    clock : Clock
    exchanges : int
        In an iteration.
    """
    plan, count = priced.allocation, len(team.states)
    patience = max(LEAST_PATIENCE, int(PATIENCE_PER_TASK * search.instance.m / exchanges))
    fraction, failures = 0.5, 0

    def attempt(number: int) -> int:
        """Try a target from the plan, and return how many iterations that took."""
        state, waited, done = team.states[number], 0, 0
        state.begin(plan, targets[number], priced.price)
        least, most = state.n_short, clock.iterations_of(number, count)
        while least and waited < patience and done < most and not clock.is_over:
            state.run(exchanges, state.weights(0.0, 0.0, 0.0, 1.0))
            done, waited = done + 1, waited + 1
            if state.n_short < least:
                least, waited = state.n_short, 0
        return done

    while failures < MOST_FAILURES and not clock.is_over and not search.fast_enough:
        assert search.fastest is not None
        best = search.fastest.evaluation.served_makespan
        bound = min(search.lower_bound, best)
        if bound >= best * (1 - RELATIVE_TOLERANCE):
            return
        targets = [best - (best - bound) * (1 - fraction) * 0.5**number for number in range(count)]
        search.iteration += sum(team.run_all(attempt, range(count)))
        reached = next((state for state in team.states if not state.n_short), None)
        if reached is None:
            fraction, failures = 1 - (1 - fraction) * 0.5**count, failures + 1
        else:
            plan, fraction, failures = reached.allocation, 0.5, 0
            search.submit(plan)
