"""How large an instance the learned policy can play within a budget; knows nothing of torch."""

from alloc.allocators.search import Budget
from alloc.problems import Instance

PAIRS_PER_SECOND = 2_000_000
"""Pairs of agent and task that are scored in a second on one slow core."""

SMALLEST = 50_000
"""Pairs that are always taken on."""

LARGEST = 6_000_000
"""Pairs beyond which the scores of one game alone take more than a gigabyte."""


def too_large(instance: Instance, budget: Budget) -> str | None:
    """Return why a game on `instance` would not end within `budget`, or None if it would.

    A game scores every pair once, and after each of up to n moves the 4 n pairs that it touched, as a rule.
    """
    n, pairs = instance.n, instance.n * (instance.m + 1)
    if pairs > LARGEST:
        return f"{pairs} pairs of agent and task are more than the {LARGEST} that it has memory for; use ga or greedy"
    needed = pairs + 4 * n * n
    if budget.time_limit_s is None or needed <= max(SMALLEST, PAIRS_PER_SECOND * budget.time_limit_s):
        return None
    seconds = needed / PAIRS_PER_SECOND
    return (
        f"a game of {n} agents may take {seconds:.0f} s, more than the time limit; give more time, or use ga or greedy"
    )
