"""Tasks that too few agents can reach: which of them to serve, and by whom.

Tasks that not every allocation with the fewest unserved tasks serves are *contested*. In each such allocation every
agent that can take a contested task serves exactly one of them, alone (Dulmage and Mendelsohn 1958,
doi:10.4153/CJM-1958-052-0). So these agents and tasks are a problem of assignment, which is solved here, and what is
left is an instance of its own, in which every task can be served.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.evaluation import RELATIVE_TOLERANCE
from alloc.problems.instance import AGENT_ARRAYS, IDLE, FloatArray, Instance, IntArray
from alloc.problems.matching.assignment import Pairs, bottleneck, cheapest, match
from alloc.problems.matching.contested import contested_part

Clock = Callable[[], float]
"""Seconds that are left."""


@dataclass(frozen=True, eq=False)
class Shortage:
    """Who serves which of the contested tasks, and what is left to be allocated.

    Attributes
    ----------
    instance : Instance
    agents : ndarray of int, shape (k,)
        All agents that can take a contested task.
    tasks : ndarray of int, shape (more than k,)
        The contested tasks.
    task_of_agent : ndarray of int, shape (k,)
        The task of each of `agents`.
    hours : float
        When the last of these is done.
    bound : float
        Hours that every allocation needs that leaves as few tasks unserved.
    rest_agents, rest_tasks : ndarray of int
        The other agents, and the other tasks with workload: what `rest` is made of.
    """

    instance: Instance
    agents: IntArray
    tasks: IntArray
    task_of_agent: IntArray
    hours: float
    bound: float
    rest_agents: IntArray
    rest_tasks: IntArray

    @property
    def rest(self) -> Instance | None:
        """The instance of `rest_agents` and `rest_tasks`; None where no task is left."""
        return _restricted(self.instance, self.rest_agents, self.rest_tasks) if len(self.rest_tasks) else None

    def merged(self, rest: Allocation | None = None) -> Allocation:
        """Return the allocation of the whole instance, with `rest` for what is left; idle without one."""
        task = np.full(self.instance.n, IDLE, dtype=np.intp)
        task[self.agents] = self.task_of_agent
        if rest is not None:
            chosen = rest.task_of_agent
            task[self.rest_agents] = np.where(chosen == IDLE, IDLE, self.rest_tasks[chosen])
        return Allocation(task)

    def part_of(self, allocation: Allocation) -> Allocation:
        """Return what an allocation of the whole instance says of `rest`."""
        number = np.full(self.instance.m + 1, IDLE, dtype=np.intp)  # the last entry is that of idle agents
        number[self.rest_tasks] = np.arange(len(self.rest_tasks))
        return Allocation(number[allocation.task_of_agent[self.rest_agents]])

    def economical(self, hours: float, time_left: Clock) -> "Shortage":
        """Return the same with the least energy within `hours`, as far as time allows."""
        pairs = (
            _pairs(self.instance, self.agents, self.tasks, hours, time_left, by_distance=True)
            if len(self.agents)
            else None
        )
        if pairs is None:
            return self
        chosen = cheapest(pairs, self.task_of_agent, pairs.distance, time_left)
        return replace(self, task_of_agent=chosen, hours=float(_hours(self.instance, self.agents, chosen).max()))


def find_shortage(instance: Instance, time_left: Clock = lambda: np.inf) -> Shortage | None:
    """Return who serves which of the contested tasks at the least makespan, or None if all tasks can be served.

    Of the allocations with that makespan, one with little work is taken. Where `time_left` runs out, the makespan may
    be more, and None may be returned although some task cannot be served.

    Parameters
    ----------
    instance : Instance
    time_left : callable
        Returns the seconds that are left.
    """
    part = contested_part(instance) or _by_least_work(instance, time_left)
    if part is None:
        return None
    agents, tasks, chosen = part
    bound = 0.0
    if len(agents) and instance.reach.is_complete and not instance.has_travel_time:
        bound = float(_hours(instance, agents, chosen).max())  # the least work by the least able: none is faster
    elif len(agents):
        chosen, bound = _fastest(instance, agents, tasks, chosen, time_left)
    needed = instance.workload > 0
    needed[tasks] = False
    others = np.ones(instance.n, dtype=np.bool_)
    others[agents] = False
    return Shortage(
        instance,
        agents,
        tasks,
        chosen,
        float(_hours(instance, agents, chosen).max(initial=0.0)),
        bound,
        np.flatnonzero(others),
        np.flatnonzero(needed),
    )


def _by_least_work(instance: Instance, time_left: Clock) -> tuple[IntArray, IntArray, IntArray] | None:
    """Return the same as `contested_part` where too many pairs are within reach for it, but every agent is needed.

    The tasks with the least work are enough, as soon as they have something for each agent.
    """
    reach, everyone = instance.reach, np.arange(instance.n)
    tasks = np.flatnonzero(instance.workload > 0)
    if reach.is_complete or reach.neighbours is not None or len(tasks) <= instance.n:
        return None
    by_work = tasks[np.argsort(instance.workload[tasks], kind="stable")]
    count = 2 * instance.n
    while count < 2 * len(tasks) and time_left() > 0:
        few = np.sort(by_work[:count])
        near = _restricted(instance, everyone, few).reach.neighbours
        if near is None:
            return None
        length = np.diff(near.first)[reach.origin]
        first = np.concatenate([[0], np.cumsum(length)])
        entry = np.repeat(near.first[reach.origin] - first[:-1], length) + np.arange(first[-1])
        found = match(first, near.task[entry])
        if (found != IDLE).all():
            return everyone, tasks, few[found]
        count *= 2
    return None


def _fastest(
    instance: Instance, agents: IntArray, tasks: IntArray, chosen: IntArray, time_left: Clock
) -> tuple[IntArray, float]:
    """Return a matching with the least makespan and, of these, one with little work; and a bound on that makespan."""
    pairs = _pairs(instance, agents, tasks, np.inf, time_left)
    if pairs is None:
        return chosen, 0.0
    chosen, bound = bottleneck(pairs, chosen, time_left)
    within = pairs.within(float(_hours(instance, agents, chosen).max()) * (1 + RELATIVE_TOLERANCE))
    _, rank = np.unique(instance.workload[within.task], return_inverse=True)
    return cheapest(within, chosen, rank.astype(np.float64), time_left), bound


def _hours(instance: Instance, agents: IntArray, tasks: IntArray) -> FloatArray:
    """Return when each of `agents` is done, alone with the task beside it."""
    return _alone(instance, agents, tasks, instance.reach.distance_of(agents, tasks))


def _alone(instance: Instance, agents: IntArray, tasks: IntArray, distance: FloatArray) -> FloatArray:
    with np.errstate(over="ignore"):
        hours = instance.workload[tasks] / instance.ability[agents] + distance / instance.speed[agents]
        return np.minimum(hours, sys.float_info.max)


def _pairs(
    instance: Instance,
    agents: IntArray,
    tasks: IntArray,
    hours: float,
    time_left: Clock,
    *,
    by_distance: bool = False,
) -> Pairs | None:
    """Return for each of k agents the k best pairs with `tasks` that it does within `hours`; None if time runs out.

    The best are the fastest, or the nearest. No more are needed: whoever has the choice of k tasks finds one of them
    free, whatever the other k - 1 agents do.
    """
    reach, contested = instance.reach, np.zeros(instance.m, dtype=np.bool_)
    contested[tasks] = True
    near = None if reach.is_complete else reach.neighbours
    k, latest = len(agents), hours * (1 + RELATIVE_TOLERANCE)
    first, parts = np.zeros(k + 1, dtype=np.intp), []
    for row, agent in enumerate(agents.tolist()):
        if time_left() <= 0:
            return None
        origin = int(reach.origin[agent])
        if near is None:
            distance, mask = (table[0] for table in reach.rows(np.array([origin])))
            task = np.flatnonzero(mask & contested)
            away = distance[task]
        else:
            span = slice(near.first[origin], near.first[origin + 1])
            useful = contested[near.task[span]]
            task, away = near.task[span][useful].astype(np.intp), near.distance[span][useful]
        time = _alone(instance, np.full(len(task), agent), task, away)
        keep = np.flatnonzero(time <= latest)
        if len(keep) > k:
            key = (away if by_distance else time)[keep]
            keep = np.sort(keep[np.argpartition(key, k - 1)[:k]])
        parts.append((task[keep], time[keep], away[keep]))
        first[row + 1] = first[row] + len(keep)
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Pairs(first, columns[0], columns[1], columns[2])


def _restricted(instance: Instance, agents: IntArray, tasks: IntArray) -> Instance:
    """Return the instance of these agents and tasks alone; agents stay where they begin."""
    number = np.full(instance.m + 1, IDLE, dtype=np.intp)
    number[tasks] = np.arange(len(tasks))
    lists = instance.allowed_tasks
    arrays = {name: getattr(instance, name)[agents] for name in AGENT_ARRAYS}
    arrays |= {"agent_position": instance.start_position[agents], "start_task": number[instance.start_task[agents]]}
    return replace(
        instance,
        agent_ids=tuple(instance.agent_ids[i] for i in agents.tolist()),
        task_ids=tuple(instance.task_ids[j] for j in tasks.tolist()),
        workload=instance.workload[tasks],
        task_position=instance.task_position[tasks],
        priority=instance.priority[tasks],
        allowed_tasks=None if lists is None else tuple(_renamed(lists[i], number) for i in agents.tolist()),
        **arrays,
    )


def _renamed(tasks: IntArray | None, number: IntArray) -> IntArray | None:
    return None if tasks is None else number[tasks][number[tasks] != IDLE]
