"""Checks of the arguments of `solve` before anything runs; errors name the parameter."""

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from alloc.allocators.contract.budget import Budget
from alloc.allocators.contract.improvement import Improvement
from alloc.allocators.contract.tolerance import EXACT, MakespanTolerance
from alloc.allocators.parallel.processors import available_threads
from alloc.allocators.result import Result
from alloc.problems import Allocation, InputError, Instance, Objective
from alloc.problems.allocation import CarriedOver, require_fit
from alloc.problems.arguments import choice, of_type, real, whole
from alloc.problems.vocabulary import OBJECTIVES

MAX_THREADS = 1024

Start = Allocation | Result | Mapping[str, str | None]
"""Warm start of a run: an allocation, a result that has one, or a mapping from agent ids to task ids."""


@dataclass(frozen=True)
class Request:
    """The checked arguments of a run, as `solve` describes them.

    Attributes
    ----------
    instance : Instance
    objective : Objective
    budget : Budget
    tolerance : MakespanTolerance
    seed : int
    start : Allocation or None
    threads : int
    on_improvement : callable or None
    stop : threading.Event
    pinned : bool
        Whether any agent is pinned.
    """

    instance: Instance
    objective: Objective
    budget: Budget
    tolerance: MakespanTolerance
    seed: int
    start: Allocation | None
    threads: int
    on_improvement: Callable[[Improvement], None] | None
    stop: threading.Event
    pinned: bool = False


def checked_tolerance(slack: float, limit: float | None, objective: Objective) -> MakespanTolerance:
    """Return the tolerance on the makespan.

    Parameters
    ----------
    slack : float
        The parameter `makespan_slack`.
    limit : float or None
        The parameter `makespan_limit`, in hours.
    objective : Objective

    Raises
    ------
    InputError
        If a number is out of range, or the objective allows no tolerance.
    """
    tolerance = MakespanTolerance(
        real(slack, "makespan_slack"),
        None if limit is None else real(limit, "makespan_limit", above=True),
    )
    if objective is Objective.MAKESPAN and tolerance != EXACT:
        name = "makespan_slack" if slack else "makespan_limit"
        goals = f"{Objective.MAKESPAN_ENERGY} or {Objective.MAKESPAN_MOVES}"
        raise InputError(f"needs the objective {goals}", name)
    return tolerance


def checked_threads(threads: int | None) -> int | None:
    """Return the number of threads, or None if none is given."""
    return None if threads is None else whole(threads, "threads", 1, MAX_THREADS)


def default_threads(budget: Budget) -> int:
    """Return the number of processors, or 1 if only iterations are limited, as the answer may depend on the number."""
    is_counted = budget.iterations is not None and budget.time_limit_s is None
    return 1 if is_counted else available_threads()


def checked_objective(objective: Objective | str) -> Objective:
    """Return the objective of a run without a plan in force.

    Raises
    ------
    InputError
        If there is no such objective, or it counts moves from a plan.
    """
    goal = choice(Objective, objective, "objective")
    if goal is Objective.MAKESPAN_MOVES:
        raise InputError(f"must be {' or '.join(OBJECTIVES)}; only solve counts moves, from its start", "objective")
    return goal


def checked_pins(pins: object) -> dict[str, str | None]:
    """Return the task id of each pinned agent by agent id; None for agents that must stay idle."""
    found: dict[str, str | None] = {}
    for agent, task in of_type({} if pins is None else pins, Mapping, "pins").items():
        if not isinstance(agent, str) or not isinstance(task, str | None):
            raise InputError(f"must map agent ids to task ids or None, got {agent!r}: {task!r}", "pins")
        found[agent] = task
    return found


def as_start(instance: Instance, given: Start) -> tuple[Allocation, CarriedOver]:
    """Return the plan that a run starts from, and how the instance has changed since that plan was made.

    Parameters
    ----------
    instance : Instance
    given : Allocation, Result or mapping
        Agents and tasks that the instance no longer has are left out of a result or a mapping.

    Raises
    ------
    InputError
        If it has another type, or does not fit `instance` at all; its `place` is ``start``.
    """
    if isinstance(given, Result) and given.allocation is not None:
        given = given.allocation.to_ids(given.instance)
    if not isinstance(given, Mapping):
        return as_allocation(instance, given, "start"), CarriedOver()
    try:
        return Allocation.carried_over(instance, given)
    except InputError as error:
        raise InputError(error.message, "start") from error


def as_allocation(instance: Instance, given: Start, name: str) -> Allocation:
    """Convert an allocation, a result or a mapping to an allocation of `instance`.

    Parameters
    ----------
    instance : Instance
    given : Allocation, Result or mapping
        An allocation, a result that has one, or task ids by agent id.
    name : str
        Name of the parameter, for errors.

    Returns
    -------
    Allocation

    Raises
    ------
    InputError
        If it has another type, or does not belong to `instance`; its `place` is `name`.
    """
    try:
        if isinstance(given, Mapping):
            return Allocation.from_ids(instance, given)
        if isinstance(given, Result):
            return _allocation_of(given, instance)
        allocation = of_type(given, (Allocation, Result), name)
        assert isinstance(allocation, Allocation)
        require_fit(instance, allocation)
        return allocation
    except InputError as error:
        raise InputError(error.message, name) from error


def _allocation_of(result: Result, instance: Instance) -> Allocation:
    if result.allocation is None:
        raise InputError("is a result without an allocation")
    other = result.instance
    if (other.agent_ids, other.task_ids) == (instance.agent_ids, instance.task_ids):
        return result.allocation
    return Allocation.from_ids(instance, result.allocation.to_ids(other))
