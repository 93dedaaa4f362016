"""What `auto` picks, and why.

The thresholds were measured on two cores. Makespan: the descent of the exact methods is within 1 % of the optimum in
the first second as long as the solver's model can be built at all, 60,000 pairs a second. Energy: `milp` proves the
least, or ends within 10 % of it, up to about 500 pairs for each second; beyond, it may not get past its first plan.
There `ga` met the least makespan, which comes first in the objective, on all of the paper's scenarios, where `gappo`
ends up to 1 % above it with about as much energy.
"""

from alloc.allocators.search import Budget
from alloc.problems import Instance, Objective, count_classes

MAKESPAN_PAIRS_PER_SECOND = 30_000
ENERGY_PAIRS_PER_SECOND = 500
UNHURRIED_S = 60.0
"""What counts as the time limit where there is none, or a longer one."""

MOST_PLACES = 2_000_000
"""Agents times tasks beyond which no method that looks at all of them often is any use."""


def choose(instance: Instance, objective: Objective, budget: Budget) -> tuple[str, str]:
    """Return the method for this instance, objective and budget, and the reason in plain words."""
    energy = objective is Objective.MAKESPAN_ENERGY
    tasks = int((instance.workload > 0).sum())
    pairs = count_classes(instance, by_place=energy) * tasks
    seconds = min(UNHURRIED_S, UNHURRIED_S if budget.time_limit_s is None else budget.time_limit_s)
    searchable = max(15_000, int(MAKESPAN_PAIRS_PER_SECOND * seconds))
    provable = max(500, int(ENERGY_PAIRS_PER_SECOND * seconds)) if energy else searchable
    exact, size = "milp" if energy else "cpsat", f"{pairs} pairs of agent class and task"
    time = "without a time limit" if budget.time_limit_s is None else f"in {budget.time_limit_s:g} s"
    if pairs <= provable:
        return exact, f"{size} are few enough for a proof, or a small gap, {time} (up to {provable})"
    if instance.has_travel_time:
        if pairs <= searchable:
            return exact, f"agents need time to travel, and {size} are few enough for a search {time}"
        return "greedy", f"agents need time to travel, and {size} are too many for a search {time}"
    if instance.n * instance.m <= MOST_PLACES:
        return "ga", f"{size} are too many for a proof {time} (more than {provable})"
    return "greedy", f"{instance.n} agents and {instance.m} tasks are too many for anything else {time}"
