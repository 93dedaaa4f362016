"""Refusals before a run: instances that a method cannot handle, or not within the budget."""

from alloc.allocators.contract.base import Allocator
from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.built_in import BUILT_IN
from alloc.allocators.contract.tolerance import EXACT, MakespanTolerance
from alloc.problems import Instance, Objective, RefusedError
from alloc.problems.distances.reach import MAX_NEIGHBOURS


def refuse(
    allocator: Allocator, instance: Instance, objective: Objective, budget: Budget, tolerance: MakespanTolerance = EXACT
) -> None:
    """Raise an error if `allocator` cannot handle `instance` within `budget`.

    Parameters
    ----------
    allocator : Allocator
    instance : Instance
    objective : Objective
    budget : Budget
    tolerance : MakespanTolerance

    Raises
    ------
    RefusedError
        With the reason, and alternative methods if there are any.
    """
    reason = _beyond(allocator, instance, objective, tolerance) or allocator.refusal(instance, objective, budget)
    if reason is not None:
        raise RefusedError(f"method {allocator.method.name!r} refuses {instance.name!r}: {reason}")


def _beyond(allocator: Allocator, instance: Instance, objective: Objective, tolerance: MakespanTolerance) -> str | None:
    """Return which required capability the method lacks, or None."""
    method = allocator.method
    if not (instance.reach.is_plain or instance.reach.has_table) and instance.reach.neighbours is None:
        return (
            f"more than {MAX_NEIGHBOURS:,} pairs of places and tasks are within reach; give ranges, or a sparse table"
        )
    if instance.has_travel_time and not method.finite_speeds:
        able = [name for name, other in BUILT_IN.items() if other.finite_speeds]
        return f"it does not support finite speeds; use {_either(able)}"
    if objective not in method.objectives:
        return f"it does not optimise {objective}"
    if tolerance != EXACT and not method.makespan_slack:
        able = [name for name, other in BUILT_IN.items() if other.makespan_slack]
        return f"it makes no use of slack for the makespan; use {_either(able)}"
    return None


def _either(names: list[str]) -> str:
    return " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
