"""Decides whether local search uses prices of tasks; does not import numba."""

from alloc.problems import Instance

MIN_AGENTS = 5_000
"""Number of agents below which linear programmes and exchanges alone do as well."""


def are_prices_used(instance: Instance) -> bool:
    """Return whether there are many agents, and tasks differ in reach or travel times."""
    return instance.n >= MIN_AGENTS and (instance.has_travel_time or not instance.reach.is_complete)
