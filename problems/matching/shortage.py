"""Shortage of agents: decide which competing tasks to serve, and by which agents.

Tasks *compete* for agents if some allocation with the fewest unserved tasks leaves them unserved. In each such
allocation every agent that can take a competing task serves exactly one of them, alone (Dulmage and Mendelsohn 1958,
doi:10.4153/CJM-1958-052-0). Hence these agents and tasks form an assignment problem, which is solved here, and the
rest is an instance in which every task can be served.
"""

from dataclasses import dataclass, replace

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.matching.assignment import Pairs, bottleneck, cheapest
from alloc.problems.matching.clock import Clock, unlimited
from alloc.problems.matching.pairs import all_pairs, bound_by_size, hours_alone, sampled_pairs
from alloc.problems.matching.precedence import Precedence
from alloc.problems.matching.unservable import CompetingPart, competing_part
from alloc.problems.vocabulary import IDLE

SAMPLE_SHARE = 0.3
"""Share of the remaining time for the pairs of an assignment, if they are sampled."""


@dataclass(frozen=True, eq=False)
class Shortage:
    """An assignment of agents to competing tasks, and the remaining instance.

    Attributes
    ----------
    instance : Instance
    agents : ndarray of int, shape (k,)
        Agents that serve one competing task each, alone.
    tasks : ndarray of int, shape (more than k,)
        The competing tasks.
    task_of_agent : ndarray of int, shape (k,)
        The task of each of `agents`.
    hours : float
        Latest completion time of these.
    bound : float
        Lower bound on the makespan of every allocation with as few unserved tasks.
    rest_agents, rest_tasks : ndarray of int
        All other agents, and all other tasks with workload, which form `rest`.
    unservable : ndarray of int
        Competing tasks that fewer agents can reach; a small set, if available.
    is_proven : bool
        Whether no allocation serves more tasks, or as many with more priority; False if time ran out.
    precedence : Precedence or None
        The matchings of `agents` with `tasks` that serve the most priority; None if all serve the same.
    """

    instance: Instance
    agents: IntArray
    tasks: IntArray
    task_of_agent: IntArray
    hours: float
    bound: float
    rest_agents: IntArray
    rest_tasks: IntArray
    unservable: IntArray
    is_proven: bool = True
    precedence: Precedence | None = None

    @property
    def rest(self) -> Instance | None:
        """Instance of `rest_agents` and `rest_tasks`; None if no task is left."""
        return self.instance.restricted(self.rest_agents, self.rest_tasks) if len(self.rest_tasks) else None

    def merged(self, rest: Allocation | None = None) -> Allocation:
        """Return the allocation of the whole instance, with `rest` for the remaining agents, by default idle."""
        task = np.full(self.instance.n, IDLE, dtype=np.intp)
        task[self.agents] = self.task_of_agent
        if rest is not None:
            chosen = rest.task_of_agent
            task[self.rest_agents] = np.where(chosen == IDLE, IDLE, self.rest_tasks[chosen])
        return Allocation(task)

    def part_of(self, allocation: Allocation) -> Allocation:
        """Return the part of an allocation of the whole instance that belongs to `rest`."""
        number = np.full(self.instance.m + 1, IDLE, dtype=np.intp)  # the last entry is for idle agents
        number[self.rest_tasks] = np.arange(len(self.rest_tasks))
        return Allocation(number[allocation.task_of_agent[self.rest_agents]])

    def economical(self, hours: float, time_left: Clock) -> "Shortage":
        """Return the shortage with an assignment of least energy within `hours`, as far as time allows."""
        if not len(self.agents):
            return self
        order = self.precedence
        args = (self.instance, self.agents, self.tasks if order is None else order.tasks, order)
        pairs, _ = _pairs(*args, self.task_of_agent, hours, time_left, by_cost=True)
        if pairs is None:
            return self
        chosen = cheapest(pairs, self.task_of_agent, pairs.cost, time_left, None if order is None else order.required)
        return replace(self, task_of_agent=chosen, hours=float(_hours(self.instance, self.agents, chosen).max()))


def find_shortage(instance: Instance, time_left: Clock = unlimited) -> Shortage | None:
    """Return an assignment for the competing tasks, or None if all tasks can be served.

    It serves the most priority, at the least makespan for that, with preference for little work. If `time_left` runs
    out, the makespan may be longer and the priority less, a task may be unserved that could be served, and None may be
    returned although some task cannot be served.

    Parameters
    ----------
    instance : Instance
    time_left : callable
        Returns the seconds left; by default no limit.

    Returns
    -------
    Shortage or None
    """
    part = competing_part(instance, time_left)
    if part is None:
        return None
    agents, tasks, chosen, bound = part.agents, part.tasks, part.task_of_agent, 0.0
    if len(agents) and instance.reach.is_complete and not instance.has_travel_time:
        bound = float(_hours(instance, agents, chosen).max())  # smallest workloads by least able agents: a lower bound
    elif len(agents):
        chosen, bound = _fastest(part, instance, time_left)
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
        bound if part.is_proven else 0.0,
        np.flatnonzero(others),
        np.flatnonzero(needed),
        part.unservable,
        part.is_proven,
        part.precedence,
    )


def _fastest(part: CompetingPart, instance: Instance, time_left: Clock) -> tuple[IntArray, float]:
    """Return a matching with the least makespan, preferring little work, and a bound on that makespan."""
    agents, chosen, order = part.agents, part.task_of_agent, part.precedence
    tasks, required = (part.tasks, None) if order is None else (order.tasks, order.required)
    latest, bound = float(_hours(instance, agents, chosen).max()), 0.0
    pairs, complete = _pairs(instance, agents, tasks, order, chosen, latest, time_left)
    while pairs is not None:
        chosen, least = bottleneck(pairs, chosen, latest, time_left, required)
        before, latest = latest, float(_hours(instance, agents, chosen).max())
        bound = least if complete else bound_by_size(instance, agents, tasks)
        if complete or latest >= before:
            break
        pairs, complete = _pairs(instance, agents, tasks, order, chosen, latest, time_left)
    if pairs is not None and complete:
        within = pairs.within(last_equal(latest))
        _, rank = np.unique(instance.workload[within.task], return_inverse=True)
        chosen = cheapest(within, chosen, rank.astype(np.float64), time_left, required)
    return chosen, bound


def _pairs(
    instance: Instance,
    agents: IntArray,
    tasks: IntArray,
    order: Precedence | None,
    known: IntArray,
    latest: float,
    time_left: Clock,
    *,
    by_cost: bool = False,
) -> tuple[Pairs | None, bool]:
    """Return pairs that finish by `latest`, None if time runs out, and whether they are as good as all pairs."""
    if instance.reach.has_table:
        return all_pairs(instance, agents, tasks, latest, time_left, by_cost=by_cost, precedence=order), True
    seconds = time_left()
    if seconds <= 0:
        return None, False
    seconds *= SAMPLE_SHARE
    pairs, complete = sampled_pairs(instance, agents, tasks, known, seconds, time_left, latest=latest, by_cost=by_cost)
    return (pairs, complete) if order is None else (pairs.chosen(order.allows(pairs.row, pairs.task)), False)


def _hours(instance: Instance, agents: IntArray, tasks: IntArray) -> FloatArray:
    """Return when each agent would finish its task alone."""
    return hours_alone(instance, agents, tasks, instance.reach.distance_of(agents, tasks))
