"""Reasons for moves: when the new task of each agent would be done without it."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.problems import Allocation, Instance
from alloc.problems.evaluation import completion_time
from alloc.problems.text import labelled, number

if TYPE_CHECKING:
    from alloc.allocators.result import Result


def reasons_of_moves(result: "Result") -> list[str]:
    """Return a line for each agent that gets a different task: when that task would be done without it.

    Parameters
    ----------
    result : Result
        Result of a run that started from the plan in force.

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
    """Return the completion time of a task without one of its agents; None if it has no other."""
    others = np.flatnonzero(allocation.task_of_agent == task)
    others = others[others != agent]
    if not len(others):
        return None
    arrival = instance.reach.distance_of(others, np.full(len(others), task)) / instance.speed[others]
    return completion_time(float(instance.workload[task]), instance.ability[others], arrival)


def _hours(instance: Instance, value: float) -> str:
    return labelled(number(value, 4), instance.units.time)
