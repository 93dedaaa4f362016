"""Tasks that too few agents can reach: which of them to serve, and by whom.

Tasks that not every allocation with the fewest unserved tasks serves *compete* for agents. In each such allocation
every agent that can take a competing task serves exactly one of them, alone (Dulmage and Mendelsohn 1958,
doi:10.4153/CJM-1958-052-0). So these agents and tasks are an assignment problem, which is solved here, and what is
left is an instance of its own, in which every task can be served.
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
"""Share of the time that is left for the pairs of an assignment, where a sample has to do."""


@dataclass(frozen=True, eq=False)
class Shortage:
    """Who serves which of the competing tasks, and what is left to be allocated.

    Attributes
    ----------
    instance : Instance
    agents : ndarray of int, shape (k,)
        Agents that serve a competing task each, alone.
    tasks : ndarray of int, shape (more than k,)
        The competing tasks.
    task_of_agent : ndarray of int, shape (k,)
        The task of each of `agents`.
    hours : float
        When the last of these is done.
    bound : float
        Hours that every allocation needs that leaves as few tasks unserved.
    rest_agents, rest_tasks : ndarray of int
        The other agents, and the other tasks with workload: what `rest` is made of.
    unservable : ndarray of int
        Competing tasks that fewer agents can reach: a set as small as is at hand.
    is_proven : bool
        Whether no allocation serves more tasks, or as many with more priority; False where time ran out.
    precedence : Precedence or None
        Which matchings of `agents` with `tasks` serve the most priority; None where all serve the same.
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
        """The instance of `rest_agents` and `rest_tasks`; None where no task is left."""
        return self.instance.restricted(self.rest_agents, self.rest_tasks) if len(self.rest_tasks) else None

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
    """Return who serves which of the competing tasks, or None if all tasks can be served.

    The most priority is served, at the least makespan that this takes, and, of the allocations with that makespan, one
    with little work is taken. Where `time_left` runs out, the makespan may be more, the priority less, some task may be
    unserved that could be served, and None may be returned although some task cannot.

    Parameters
    ----------
    instance : Instance
    time_left : callable
        Returns the seconds that are left; no limit by default.

    Returns
    -------
    Shortage or None
    """
    part = competing_part(instance, time_left)
    if part is None:
        return None
    agents, tasks, chosen, bound = part.agents, part.tasks, part.task_of_agent, 0.0
    if len(agents) and instance.reach.is_complete and not instance.has_travel_time:
        bound = float(_hours(instance, agents, chosen).max())  # the least work by the least able: none is faster
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
    """Return a matching with the least makespan and, of these, one with little work; and a bound on that makespan."""
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
    """Return pairs that are done by `latest`, None if time runs out, and whether they are as good as all pairs."""
    if instance.reach.has_table:
        return all_pairs(instance, agents, tasks, latest, time_left, by_cost=by_cost, precedence=order), True
    seconds = time_left()
    if seconds <= 0:
        return None, False
    seconds *= SAMPLE_SHARE
    pairs, complete = sampled_pairs(instance, agents, tasks, known, seconds, time_left, latest=latest, by_cost=by_cost)
    return (pairs, complete) if order is None else (pairs.chosen(order.allows(pairs.row, pairs.task)), False)


def _hours(instance: Instance, agents: IntArray, tasks: IntArray) -> FloatArray:
    """Return when each of `agents` is done, alone with the task beside it."""
    return hours_alone(instance, agents, tasks, instance.reach.distance_of(agents, tasks))
