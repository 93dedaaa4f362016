"""Random restarts with steepest descent: a complete allocator in one file."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators import Allocator, Method, Proposal, Search
from alloc.problems import IDLE, Allocation, Instance, Objective, serve_all


class RandomRestart(Allocator):
    """Assign agents at random, then move agents to the last task while that helps; restart from a new allocation."""

    method = Method(
        name="random-restart",
        summary="repeated descent from random allocations",
        objectives=(Objective.MAKESPAN,),
        anytime=True,
    )

    def allocate(self, search: Search) -> Proposal:
        """Return when the budget is spent; `search` keeps the best allocation and says when to stop."""
        rng = np.random.default_rng(search.seed)
        while not (search.should_stop() and search.best):
            dealt = serve_all(search.instance, deal(search.instance, rng))
            search.submit(descend(search, dealt))
            search.iteration += 1
        return Proposal()  # the best that was submitted


def deal(instance: Instance, rng: np.random.Generator) -> Allocation:
    """Assign each agent to a random task in its reach, with probabilities proportional to workloads."""
    weights = instance.reach.mask * instance.workload
    total = weights.sum(axis=1, keepdims=True)
    bounds = np.cumsum(np.divide(weights, total, out=np.zeros_like(weights), where=total > 0), axis=1)
    drawn = (bounds[instance.reach.origin] < rng.random((instance.n, 1))).sum(axis=1)
    drawn = np.minimum(drawn, instance.m - 1)  # rounding may leave the last bound short of 1
    good = instance.reach.allows(np.arange(instance.n), drawn)
    return Allocation(np.where(good, drawn, IDLE))


def descend(search: Search, allocation: Allocation) -> Allocation:
    """Move one agent at a time to the last task, choosing the one whose old task is delayed least."""
    instance, task = search.instance, allocation.task_of_agent.copy()
    work, reach = instance.workload, instance.reach
    busy = task != IDLE
    group = np.bincount(task[busy], weights=instance.ability[busy], minlength=instance.m).astype(float)
    while not search.should_stop():
        hours = completion_times(work, group)
        last = int(np.argmax(hours))
        able = np.flatnonzero(reach.mask[reach.origin, last] & (task != last))
        left = task[able]
        after = np.where(left == IDLE, 0.0, completion_times(work[left], group[left] - instance.ability[able]))
        after = np.maximum(after, work[last] / (group[last] + instance.ability[able]))
        if not len(able) or after.min() >= hours[last]:
            break
        agent = able[np.argmin(after)]
        if task[agent] != IDLE:
            group[task[agent]] -= instance.ability[agent]
        group[last] += instance.ability[agent]
        task[agent] = last
    return Allocation(task)


def completion_times(work: NDArray[np.float64], group: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return h / W (4): 0 without work, inf without agents."""
    empty = group <= 1e-12 * (1 + work)  # rounding error left after the last agent is removed
    return np.where(work > 0, np.divide(work, group, out=np.full_like(work, np.inf), where=~empty), 0.0)
