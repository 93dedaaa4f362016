"""The bottleneck of an allocation: the last task, and what one more agent there would gain."""

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
    """The last task of an allocation that serves all tasks, and what would make it sooner.

    Attributes
    ----------
    last : tuple of int
        The tasks that are done at the makespan, within 1e-9 relative; several if they are last together.
    makespan : float
        In hours.
    agents : tuple of int
        The agents on the first task of `last`.
    next_task : int or None
        The latest of the other tasks; None if there is none with workload.
    next_time : float
        When that one is done, in hours; 0 if there is none.
    use : float
        Share of all ability, from hour 0 to the makespan, that is at work; the rest is idle, done early, or travels.
    enough : Gain or None
        With the least ability of one more agent there for which `next_task` is the last one; more ability gains
        nothing. None if several tasks are last together, or there is no next one.
    typical : Gain or None
        With one more agent of the median ability of all agents; None if several tasks are last together.
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

    The additional agent is on the task from hour 0 on, whatever the speeds of the others; all other agents stay where
    they are.

    Parameters
    ----------
    instance : Instance
    allocation : Allocation

    Returns
    -------
    Bottleneck or None
        None if a task is unserved, or there is no work at all.

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
    """Return the makespan in hours with one more agent of `ability`, which is on `task` from hour 0 on.

    Parameters
    ----------
    found : Evaluation
        Scores without that agent.
    agents : ndarray of int, shape (k,)
        The agents that are on `task` already, and can do it.
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
    """Return the agents that are on `task` and can do it."""
    there = np.flatnonzero(allocation.task_of_agent == task)
    return there[instance.reach.allows(there, np.full(len(there), task))]


def _enough(instance: Instance, found: Evaluation, agents: IntArray, task: int, next_time: float) -> Gain:
    """Return the gain with the ability for what the group leaves undone at `next_time`."""
    hours = np.maximum(0.0, next_time - _arrival(instance, agents, task))
    left = instance.workload[task] - float((instance.ability[agents] * hours).sum())
    return _gain(instance, found, agents, task, left / next_time)


def _gain(instance: Instance, found: Evaluation, agents: IntArray, task: int, ability: float) -> Gain:
    return Gain(ability, makespan_with_agent(instance, found, agents, task, ability))
