"""The start of local search on large instances: a bound from prices of tasks, and a plan according to them."""

import time
from typing import NamedTuple

from alloc.allocators.contract.search import Search
from alloc.allocators.heuristic.task_prices.prices import TaskPrices
from alloc.allocators.heuristic.task_prices.rounding import rounded
from alloc.allocators.heuristic.task_prices.use import are_prices_used
from alloc.allocators.parallel.pool import thread_map
from alloc.problems import Allocation, Instance, serve_all
from alloc.problems.instance import FloatArray

TIME_SHARE = 0.5
"""Share of the remaining time for the prices."""

CLOSE = 0.003
"""Gap up to which the current plan is the better start, as plans from prices are hardly closer to the bound."""

MAX_THREADS = 32
"""Maximum number of threads that are used."""


class PricedPlan(NamedTuple):
    """A plan according to prices, and the prices of a unit of ability on each task, shape (m,)."""

    allocation: Allocation
    price: FloatArray


def plan_by_prices(search: Search) -> PricedPlan | None:
    """Raise the bound by prices of tasks, submit a plan according to them, and return it.

    In such a plan, shortfalls are small, and agents can change tasks at little loss, so that exchanges soon bring it
    close to the bound.

    Returns
    -------
    PricedPlan or None
        None if there are few agents, or the prices do not raise the bound.
    """
    instance = search.instance
    if not are_prices_used(instance) or search.lower_bound <= 0 or search.fast_enough or search.should_stop():
        return None
    end = time.monotonic() + TIME_SHARE * search.remaining_s
    threads = min(search.threads, MAX_THREADS)
    with thread_map(threads) as run_all:
        prices = TaskPrices(instance, search.lower_bound, run_all, threads)
        helped = prices.improve(end, lambda: search.interrupted)
    search.raise_bound(prices.bound)
    if not helped or search.gap <= CLOSE or search.should_stop():
        return None
    plan = serve_all(instance, rounded(prices, search.should_stop), lambda: search.remaining_s)
    search.submit(plan)
    return PricedPlan(plan, prices.price)


def compile_loops() -> None:
    """Compile the loops, or load them from the cache."""
    one = Instance(ability=[1.0], workload=[1.0], agent_position=[[0, 0]], task_position=[[1, 0]], speed=[1.0])
    prices = TaskPrices(one, 1.0, map, 1)
    prices.evaluate_all().value(prices.price, 1.0, 0.1)
    rounded(prices)
