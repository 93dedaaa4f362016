"""Reasons for unserved tasks: agents that could serve them but do others, or how far the nearest one falls short."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.evaluation import evaluate, reason_of
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.text import counted, number
from alloc.problems.vocabulary import IDLE

MAX_TASKS = 10
"""Maximum number of tasks with a reason, those with the highest priority first."""

MAX_AGENTS = 3
"""Maximum number of agents that a reason names."""


@dataclass(frozen=True)
class Unserved:
    """The reason why a task is unserved in an allocation.

    Attributes
    ----------
    task : int
    priority : float
    able_agents : tuple of int
        Agents that can take the task, at most `MAX_AGENTS`.
    able : int
        Number of all agents that can take it.
    nearest : int or None
        If no agent can take it, the one that falls short by the least.
    reason : str
        The reason as text, with the ids of the instance.
    """

    task: int
    priority: float
    able_agents: tuple[int, ...]
    able: int
    nearest: int | None
    reason: str


def why_unserved(
    instance: Instance, allocation: Allocation, most: int = MAX_TASKS, pinned: Collection[int] = ()
) -> tuple[Unserved, ...]:
    """Return the reasons why tasks are unserved, those with the highest priority first.

    Takes O(n) time per task.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation
    most : int
        Maximum number of tasks.
    pinned : collection of int
        Agents whose tasks were fixed.

    Returns
    -------
    tuple of Unserved

    Raises
    ------
    InputError
        If the allocation does not fit the instance.
    """
    tasks = np.array(evaluate(instance, allocation).unserved_tasks, dtype=np.intp)
    tasks = tasks[np.argsort(-instance.priority[tasks], kind="stable")][:most]
    return tuple(_why(instance, allocation, task, pinned) for task in tasks.tolist())


def _why(instance: Instance, allocation: Allocation, task: int, pinned: Collection[int]) -> Unserved:
    able = instance.reach.agents_of(task)
    nearest = None if len(able) else _nearest(instance, task)
    reason = _busy(instance, allocation, able, pinned) if nearest is None else _short(instance, nearest, task)
    first = tuple(able[:MAX_AGENTS].tolist())
    return Unserved(task, float(instance.priority[task]), first, len(able), nearest, reason)


def _busy(instance: Instance, allocation: Allocation, able: IntArray, pinned: Collection[int]) -> str:
    """Return what the agents that could take the task do instead."""
    named = able[:MAX_AGENTS].tolist()
    doing = []
    for agent in named:
        held = int(allocation.task_of_agent[agent])
        works = held != IDLE and bool(instance.reach.allows(np.array([agent]), np.array([held]))[0])
        priority = (
            f" (priority {number(float(instance.priority[held]))})" if works and _has_priorities(instance) else ""
        )
        if agent in pinned:
            does = f"is pinned to {instance.task_ids[held]}{priority}" if works else "is pinned to no task"
        else:
            does = f"does {instance.task_ids[held]}{priority}" if works else "is idle"
        doing.append(f"{instance.agent_ids[agent]} {does}")
    others = f", and {counted(len(able) - len(named), 'other')}" if len(able) > len(named) else ""
    return f"{counted(len(able), 'agent')} could take it: {', '.join(doing)}{others}"


def _has_priorities(instance: Instance) -> bool:
    return bool(np.ptp(instance.priority) > 0)


def _nearest(instance: Instance, task: int) -> int:
    """Return an agent that falls short of the task by the least; eligible ones or those with most skills come first."""
    reach, first = instance.reach, instance.reach.agents_by_origin
    origins = np.arange(len(reach.place))
    listed = np.array([task in tasks for tasks in reach.lists] + [True])
    excess = _excess(instance, origins, task)
    excess[~listed[reach.list_of]] = np.inf
    if np.isfinite(excess).any():
        return int(first[1][first[0][int(excess.argmin())]])
    needs, skills = instance.needs, instance.skills
    if needs is None or not needs[task] or skills is None:
        return int(first[1][first[0][int(_excess(instance, origins, task).argmin())]])
    wanted = set(needs[task])
    lacking = np.array([len(wanted.difference(held)) for held in skills])
    return int(np.lexsort((_excess(instance, origins, task)[reach.origin], lacking))[0])


def _excess(instance: Instance, origins: IntArray, task: int) -> FloatArray:
    """Return the relative excess of the distance to the task over range or battery of each origin; < 0 if within."""
    reach, goal = instance.reach, np.full(len(origins), task)
    distance = reach.distances_between(origins, goal)
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        needed = reach.energy_per_distance * reach.flown(origins, goal, distance)
        far = distance / np.maximum(reach.communication_range + TOLERANCE, TOLERANCE)
        costly = needed / np.maximum(reach.battery + TOLERANCE, TOLERANCE)
    excess: FloatArray = np.maximum(far, costly) - 1
    return np.minimum(excess, np.finfo(np.float64).max)


def _short(instance: Instance, agent: int, task: int) -> str:
    """Return why an agent cannot take the task, given that no agent can."""
    reason = reason_of(instance, agent, task)
    needs = () if instance.needs is None else instance.needs[task]
    needed = f" (it needs {', '.join(map(repr, needs))})" if needs else ""
    return f"no agent can take it{needed}; nearest is {instance.agent_ids[agent]}: {reason}"
