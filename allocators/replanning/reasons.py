"""Why each agent moves: what its new task would be without it."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.problems import Allocation, Instance, evaluate
from alloc.problems.text import labelled, number
from alloc.problems.vocabulary import IDLE

if TYPE_CHECKING:
    from alloc.allocators.result import Result


def reasons_of_moves(result: "Result") -> list[str]:
    """Return one line for each agent that gets another task than it had: when that task would be done without it.

    Parameters
    ----------
    result : Result
        Of a run with the plan in force as its start.

    Returns
    -------
    list of str
    """
    if result.moves is None or result.allocation is None or result.evaluation is None:
        return []
    instance, hours = result.instance, result.evaluation.completion_time
    lines = []
    for agent in result.moves.agents:
        task = int(result.allocation.task_of_agent[agent])
        without = _time_without(instance, result.allocation, agent, task)
        then = "undone" if without is None else f"done at {_hours(instance, without)}"
        name, goal = instance.agent_ids[agent], instance.task_ids[task]
        lines.append(f"{name} goes to {goal}: {then} without it, at {_hours(instance, float(hours[task]))} with it")
    return lines


def _time_without(instance: Instance, allocation: Allocation, agent: int, task: int) -> float | None:
    """Return when a task is done without one of its agents, None where it has no other."""
    others = np.where(allocation.task_of_agent == task, task, IDLE)
    others[agent] = IDLE
    score = evaluate(instance, Allocation(others))
    return None if task in score.unserved_tasks else float(score.completion_time[task])


def _hours(instance: Instance, value: float) -> str:
    return labelled(number(value, 4), instance.units.time)
