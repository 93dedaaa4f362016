"""The bottleneck of an allocation: its last task, and what one more agent there would gain."""

import sys
from dataclasses import dataclass

import numpy as np

from alloc.problems import Allocation, Evaluation, Instance, evaluate
from alloc.problems.evaluation import RELATIVE_TOLERANCE, completion_time
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True)
class Gain:
    """The makespan with one more agent on the last task.

    Attributes
    ----------
    ability : float
        Work per hour of that agent.
    makespan : float
        In hours, with that agent.
    """

    ability: float
    makespan: float


@dataclass(frozen=True)
class Bottleneck:
    """The last task of an allocation that serves all tasks, and what would complete it sooner.

    Attributes
    ----------
    last : tuple of int
        The tasks that are completed at the makespan, within 1e-9 relative; usually one.
    makespan : float
        In hours.
    agents : tuple of int
        The agents on the first task of `last`.
    next_task : int or None
        The latest of the other tasks; None if no other task has workload.
    next_time : float
        Completion time of `next_task`, in hours; 0 if there is none.
    use : float
        Share of the total ability that is at work between hour 0 and the makespan; the remainder is of agents that are
        idle, travel, or have completed their task.
    enough : Gain or None
        Gain with one more agent of the least ability for which `next_task` becomes the last; more ability gains
        nothing. None if several tasks are last, or there is no next one.
    typical : Gain or None
        Gain with one more agent of the median ability of all agents; None if several tasks are last.
    """

    last: tuple[int, ...]
    makespan: float
    agents: tuple[int, ...]
    next_task: int | None
    next_time: float
    use: float
    enough: Gain | None
    typical: Gain | None


def explain(instance: Instance, allocation: Allocation) -> Bottleneck | None:
    """Return the bottleneck of an allocation: its last task, and what one more agent there would gain.

    The additional agent works on the task from hour 0 on, whatever the speeds of the others; all other agents keep
    their tasks.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation

    Returns
    -------
    Bottleneck or None
        None if a task is unserved, or no task has workload.

    Raises
    ------
    InputError
        If the allocation does not belong to the instance.
    """
    evaluation = evaluate(instance, allocation)
    makespan = evaluation.makespan
    if not makespan:
        return None
    time = evaluation.completion_time
    is_last = time >= makespan * (1 - RELATIVE_TOLERANCE)
    last = tuple(np.flatnonzero(is_last).tolist())
    others = np.where(is_last, 0.0, time)
    next_time = float(others.max())
    agents = _working(instance, allocation, last[0])
    alone = len(last) == 1
    typical = float(np.median(instance.ability))
    return Bottleneck(
        last=last,
        makespan=makespan,
        agents=tuple(agents.tolist()),
        next_task=int(others.argmax()) if next_time > 0 else None,
        next_time=next_time,
        use=float(instance.workload.sum() / (instance.ability.sum() * makespan)),
        enough=_enough(instance, evaluation, agents, last[0], next_time) if alone and next_time > 0 else None,
        typical=_gain(instance, evaluation, agents, last[0], typical) if alone else None,
    )


def makespan_with_agent(instance: Instance, found: Evaluation, agents: IntArray, task: int, ability: float) -> float:
    """Return the makespan, in hours, if one more agent of `ability` works on `task` from hour 0 on.

    Parameters
    ----------
    found : Evaluation
        Scores without that agent.
    agents : ndarray of int, shape (k,)
        The agents that work on `task` already.
    task : int
    ability : float
        Work per hour of the additional agent.
    """
    abilities = np.append(instance.ability[agents], ability)
    time = found.completion_time.copy()
    time[task] = completion_time(instance.workload[task], abilities, np.append(_arrival(instance, agents, task), 0.0))
    return float(np.minimum(time, sys.float_info.max).max())


def _arrival(instance: Instance, agents: IntArray, task: int) -> FloatArray:
    """Return the hour at which each agent arrives at `task`."""
    with np.errstate(over="ignore"):
        return instance.reach.distance_of(agents, np.full(len(agents), task)) / instance.speed[agents]


def _working(instance: Instance, allocation: Allocation, task: int) -> IntArray:
    """Return the agents that are assigned to `task` and can do it."""
    there = np.flatnonzero(allocation.task_of_agent == task)
    return there[instance.reach.allows(there, np.full(len(there), task))]


def _enough(instance: Instance, found: Evaluation, agents: IntArray, task: int, next_time: float) -> Gain:
    """Return the gain with an agent of just the ability to do the work that the group has left at `next_time`."""
    hours = np.maximum(0.0, next_time - _arrival(instance, agents, task))
    left = instance.workload[task] - float((instance.ability[agents] * hours).sum())
    return _gain(instance, found, agents, task, left / next_time)


def _gain(instance: Instance, found: Evaluation, agents: IntArray, task: int, ability: float) -> Gain:
    return Gain(ability, makespan_with_agent(instance, found, agents, task, ability))
