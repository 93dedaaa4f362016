"""What `auto` picks, and why."""

from alloc.allocators.search import Budget
from alloc.problems import Instance, Objective, agent_classes


def choose(instance: Instance, objective: Objective, budget: Budget) -> tuple[str, str]:
    """Return the method for this instance, objective and budget, and the reason in plain words."""
    energy = objective is Objective.MAKESPAN_ENERGY
    size = agent_classes(instance, by_place=energy).size * instance.m
    limit = 2_000 if energy else 20_000
    pairs = f"{size} pairs of agent class and task"
    if size <= limit:
        return ("milp" if energy else "cpsat"), f"{pairs} are few enough for a proof"
    if instance.has_travel_time or instance.n * instance.m > 2_000_000:
        return "greedy", f"{pairs} are too many for a proof, and for a search in this budget"
    return "gappo", f"{pairs} are too many for a proof"
