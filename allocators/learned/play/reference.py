"""The reference makespan, by which the needs of a game are set."""

from alloc.problems import Instance, lp_makespan_lower_bound, makespan_lower_bound


def reference_makespan(instance: Instance, lp_time_limit_s: float = 1.0) -> float:
    """Return T_ref, the best lower bound on the makespan that is cheap to compute, in hours."""
    bound = makespan_lower_bound(instance)
    if not instance.reach.is_complete:
        bound = max(bound, lp_makespan_lower_bound(instance, lp_time_limit_s) or 0.0)
    return bound
