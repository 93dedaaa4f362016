"""Which instances have prices of tasks in local search; does not import numba."""

from alloc.problems import Instance

LEAST_AGENTS = 5_000
"""Agents below which linear programmes and exchanges alone do as well."""


def are_prices_used(instance: Instance) -> bool:
    """Return whether there are many agents, for whom tasks differ by more than their workloads."""
    return instance.n >= LEAST_AGENTS and (instance.has_travel_time or not instance.reach.is_complete)
