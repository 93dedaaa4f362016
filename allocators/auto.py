"""The method that `auto` picks for an instance, and why.

Exact methods alternate local search with their own searches and bounds, so the choice only decides how the time is
divided. The threshold was measured on two cores. For the makespan, exact methods pay off as long as the solver's model
can be built in time, at 60,000 pairs per second. For the energy, they match pure local search up to the threshold, and
leave a third of its gap; beyond, their plans took up to 3 % more energy on some instances.
"""

from alloc.allocators.contract.budget import Budget
from alloc.problems import Instance, Objective, count_classes
from alloc.problems.text import counted

PICKED = ("cpsat", "milp", "local-search")
"""Methods that `choose` picks from."""

PAIRS_PER_SECOND, MIN_PAIRS = 30_000, 15_000
"""Pairs of agent class and task per second up to which exact methods are picked, and the minimum of this limit."""

MAX_PAIRS_SEARCHED = 4_000_000
"""Number of agents times tasks above which the exact methods skip their own searches for plans."""

UNHURRIED_S = 60.0
"""Time limit in seconds that is assumed if it is longer, or if there is none."""


def choose(instance: Instance, objective: Objective, budget: Budget) -> tuple[str, str]:
    """Return the name of the method for an instance, objective and budget, and the reason for it."""
    energy = objective is Objective.MAKESPAN_ENERGY
    tasks = int((instance.workload > 0).sum())
    pairs = count_classes(instance, by_place=energy) * tasks
    seconds = min(UNHURRIED_S, UNHURRIED_S if budget.time_limit_s is None else budget.time_limit_s)
    limit = max(MIN_PAIRS, int(PAIRS_PER_SECOND * seconds))
    size = f"{counted(pairs, 'pair')} of agent class and task"
    time = "without a time limit" if budget.time_limit_s is None else f"in {budget.time_limit_s:.3g} s"
    if pairs <= limit and instance.n * instance.m <= MAX_PAIRS_SEARCHED:
        return (
            "milp" if energy else "cpsat",
            f"{size}, few enough for a proof, or a small gap, {time} (up to {limit})",
        )
    if pairs <= limit:
        return (
            "local-search",
            f"{instance.n} agents and {instance.m} tasks are too many for the search of exact methods",
        )
    return "local-search", f"{size}, too many for a proof {time} (more than {limit})"
