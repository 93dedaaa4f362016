"""What holds the makespan up: the last task, and what one more agent there would gain."""

from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from alloc.problems import IDLE, Allocation, Evaluation, Instance, evaluate
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import IntArray


@dataclass(frozen=True)
class Gain:
    """What one more agent on the last task would change.

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
    """The last task of an allocation that serves all tasks.

    Attributes
    ----------
    last : tuple of int
        The tasks that are done at the makespan, within 1e-9 relative; more than one if they are last together.
    makespan : float
        In hours.
    agents : tuple of int
        The agents on the first of `last`.
    next_task : int or None
        The latest of the other tasks; None if there is none with workload.
    next_time : float
        When that one is done, in hours; 0 if there is none.
    use : float
        Share of all ability, from hour 0 to the makespan, that does work; the rest is idle, done early, or travels.
    enough : Gain or None
        The least ability of one more agent on the last task with which `next_task` is the last one: beyond it, more
        ability there gains nothing. None if several tasks are last together, or there is no next one.
    typical : Gain or None
        The same with the median ability of the agents there are; None if several tasks are last together.
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
    """Say which task holds the makespan up, and what one more agent there would gain.

    The further agent is on the task from hour 0 on, however fast the others are, and everything else stays as it is.

    Returns
    -------
    Bottleneck or None
        None while a task is unserved, and if there is no work at all.
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
    agents = np.flatnonzero(_working(instance, allocation, last[0]))
    alone = len(last) == 1
    typical = float(np.median(instance.ability))
    return Bottleneck(
        last=last,
        makespan=makespan,
        agents=tuple(agents.tolist()),
        next_task=int(others.argmax()) if next_time > 0 else None,
        next_time=next_time,
        use=float(instance.workload.sum() / (instance.ability.sum() * makespan)),
        enough=_enough(instance, allocation, last[0], agents, next_time) if alone and next_time > 0 else None,
        typical=_gain(instance, allocation, last[0], typical) if alone else None,
    )


def evaluate_with_agent(instance: Instance, allocation: Allocation, task: int, ability: float) -> Evaluation:
    """Score `allocation` with one more agent of `ability`, which is on `task` from hour 0 on."""
    return evaluate(_with_agent(instance, ability), Allocation([*allocation.task_of_agent, task]))


def _working(instance: Instance, allocation: Allocation, task: int) -> NDArray[np.bool_]:
    """Who is on `task`, and can take it."""
    there: NDArray[np.bool_] = allocation.task_of_agent == task
    able: NDArray[np.bool_] = instance.reach.mask[instance.reach.origin, task]
    return there & able


def _enough(
    instance: Instance,
    allocation: Allocation,
    task: int,
    agents: IntArray,
    next_time: float,
) -> Gain:
    """What the group leaves undone at `next_time`, over `next_time`."""
    distance = instance.reach.distance_of(agents, np.full(len(agents), task))
    hours = np.maximum(0.0, next_time - distance / instance.speed[agents])
    left = instance.workload[task] - float((instance.ability[agents] * hours).sum())
    return _gain(instance, allocation, task, left / next_time)


def _gain(instance: Instance, allocation: Allocation, task: int, ability: float) -> Gain:
    makespan = evaluate_with_agent(instance, allocation, task, ability).makespan
    assert makespan is not None, "an agent more left a task unserved"
    return Gain(ability, makespan)


def _with_agent(instance: Instance, ability: float) -> Instance:
    """Add an agent without a place, which is near everything and can take every task."""
    allowed, names = instance.allowed_tasks, set(instance.agent_ids)
    return replace(
        instance,
        agent_ids=(*instance.agent_ids, next(name for name in map(str, count()) if name not in names)),
        ability=np.append(instance.ability, ability),
        agent_position=np.vstack([instance.agent_position, np.full(3, np.nan)]),
        start_task=np.append(instance.start_task, IDLE),
        battery=np.append(instance.battery, np.inf),
        communication_range=np.append(instance.communication_range, np.inf),
        speed=np.append(instance.speed, np.inf),
        allowed_tasks=None if allowed is None else (*allowed, None),
    )
