"""The compiled loop over exchanges, with noise that cools down."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import Ground, Small
from alloc.allocators.heuristic.local_search.kernels import exchange, keep
from alloc.allocators.heuristic.local_search.plan import BEST, CROWDED, FLOWN, SHORTS, Plan, Scratch, Weights
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import draw

TRIES = 30
"""Agents that are drawn to find one that reaches a task."""

WILD = 8
"""One in so many exchanges is with any task, not with a near one."""

SMALLEST_GAIN = 1e-10
"""Relative part of the distance by which a plan must be better than the best to be kept."""


class Near(NamedTuple):
    """Candidates for exchanges.

    Attributes
    ----------
    row : ndarray of int, shape (origins,)
        Row of each origin in `of_origin`.
    of_origin : ndarray of int, shape (rows, k)
        Tasks near an origin, -1 for none.
    of_task : ndarray of int, shape (m, k)
        Tasks near a task, -1 for none.
    """

    row: Small
    of_origin: Small
    of_task: Small


@compiled
def any_of(state: NDArray[np.uint64], tasks: int, row: Small) -> int:
    """Return a random task of a row of candidates, sometimes any task at all."""
    if draw(state, WILD) == 0:
        return draw(state, tasks)
    candidate: int = row[draw(state, row.shape[0])]
    return candidate


@compiled
def helper(ground: Ground, plan: Plan, task: int) -> int:
    """Return a random agent that may be able to come to a task: one of a few drawn that reaches it, if there is one."""
    agent = 0
    table, origin, state, agents = ground.table, ground.origin, plan.random, plan.task.shape[0]
    for _ in range(TRIES):
        agent = draw(state, agents)
        if table.shape[0] == 0 or table[origin[agent], task] < np.inf:
            break
    return agent


@compiled
def anneal(
    ground: Ground, plan: Plan, scratch: Scratch, near: Near, hours: float, steps: int, weights: Weights, cooling: float
) -> float:
    """Make `steps` exchanges, the noise falling by the factor `cooling` at each; return the noise reached.

    Where distance has no weight, only tasks that lack something are tended, and the loop ends as soon as none does;
    otherwise the plan of least distance without any lack is kept.
    """
    tasks, agents = plan.need.shape[0] - 1, plan.task.shape[0]
    noise = weights.noise
    for _ in range(steps):
        noise *= cooling
        now = Weights(weights.distance, noise, weights.charge, weights.lack, weights.spare, weights.sums)
        agent = -1
        if plan.counter[SHORTS] > 0 and (weights.distance == 0.0 or draw(plan.random, 4) == 0):
            task = plan.short[draw(plan.random, plan.counter[SHORTS])]
            if plan.size[tasks] > 0 and draw(plan.random, 2) == 0:
                other = tasks
            else:
                agent = helper(ground, plan, task)
                other = plan.task[agent]
        else:
            agent = draw(plan.random, agents)
            other = plan.task[agent]
            task = any_of(plan.random, tasks, near.of_origin[near.row[ground.origin[agent]]])
            spare = other < tasks and plan.load[other] > plan.need[other]
            if other < tasks and (task == other or (spare and draw(plan.random, 4) == 0)):
                if spare or plan.size[tasks] > 0:
                    task, other = other, tasks
                else:
                    task = any_of(plan.random, tasks, near.of_task[other])
        if (
            task < 0
            or other < 0
            or task == other
            or plan.need[task] == 0.0
            or (other < tasks and plan.need[other] == 0.0)
        ):
            continue
        exchange(ground, plan, scratch, now, hours, agent, task, other)
        if plan.counter[CROWDED] > 0:
            break
        if plan.counter[SHORTS] == 0:
            if weights.distance == 0.0:
                break
            if plan.figure[FLOWN] < plan.figure[BEST] * (1 - SMALLEST_GAIN):
                keep(plan)
    return noise
