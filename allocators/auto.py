"""The method that `auto` picks, and why.

The thresholds were measured on two cores. For the makespan, exact methods find good plans as long as the solver's model
can be built at all, 60,000 pairs a second. For the energy they reach a gap of about 1 % up to about 1,000 pairs per
second of the time limit; up to 5,000 their plans are as good as those of the local search, with a far better bound.
Beyond that, the local search finds better allocations in the same time.
"""

from alloc.allocators.contract.budget import Budget
from alloc.problems import Instance, Objective, count_classes

MAKESPAN_PAIRS_PER_SECOND = 30_000
ENERGY_PAIRS_PER_SECOND = 5_000
MOST_PLACES = 4_000_000
"""Agents times tasks beyond which the exact methods no longer search for plans by themselves."""

UNHURRIED_S = 60.0
"""What counts as the time limit where there is none, or a longer one."""


def choose(instance: Instance, objective: Objective, budget: Budget) -> tuple[str, str]:
    """Return the method for this instance, objective and budget, and the reason in plain words."""
    energy = objective is Objective.MAKESPAN_ENERGY
    tasks = int((instance.workload > 0).sum())
    pairs = count_classes(instance, by_place=energy) * tasks
    seconds = min(UNHURRIED_S, UNHURRIED_S if budget.time_limit_s is None else budget.time_limit_s)
    searchable = max(15_000, int(MAKESPAN_PAIRS_PER_SECOND * seconds))
    few = max(1_000, int(ENERGY_PAIRS_PER_SECOND * seconds)) if energy else searchable
    size = f"{pairs} pairs of agent class and task"
    time = "without a time limit" if budget.time_limit_s is None else f"in {budget.time_limit_s:g} s"
    if pairs <= few and instance.n * instance.m <= MOST_PLACES:
        return "milp" if energy else "cpsat", f"{size} are few enough for a proof, or a small gap, {time} (up to {few})"
    if pairs <= few:
        return (
            "local-search",
            f"{instance.n} agents and {instance.m} tasks are too many for the search of exact methods",
        )
    return "local-search", f"{size} are too many for a proof {time} (more than {few})"
