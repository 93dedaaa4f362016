"""Limits on the size of instances that a learned policy can play within a budget; does not import torch."""

from alloc.allocators.contract.budget import Budget
from alloc.problems import Instance

NEAR = 20
"""Number of candidate tasks per agent, besides being idle, in games on a whole instance."""

PAIRS_PER_SECOND = 40_000
"""Pairs of agent and candidate in a game that takes a second on a slow core."""

PLACES = 12
"""Pairs of places, between which there is attention, that take as long as one pair of agent and candidate."""

MAX_PAIRS = 3_000_000
"""Number of pairs above which a game takes more than a few gigabytes."""

MAX_TASKS = 4_000
"""Number of tasks above which the attention between them takes more than a few gigabytes."""


def too_large(instance: Instance, budget: Budget) -> str | None:
    """Return why a game on `instance` would not end within `budget`, or None if it would."""
    n, m = instance.n, instance.m
    pairs = n * (min(NEAR, m) + 1)
    if m > MAX_TASKS:
        return f"{m} tasks are more than the {MAX_TASKS} that it has memory for; use local-search"
    if pairs > MAX_PAIRS:
        return f"{n} agents are more than the {MAX_PAIRS // (NEAR + 1)} that it has memory for; use local-search"
    seconds = (pairs + m * m // PLACES) / PAIRS_PER_SECOND
    if budget.time_limit_s is None or seconds <= max(1.0, budget.time_limit_s):
        return None
    return f"a game of {n} agents and {m} tasks may take {seconds:.0f} s; give more time, or use local-search"
