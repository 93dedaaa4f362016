"""Tasks put into routes one by one, always the one that takes least time for its weight."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

import numpy as np

from alloc.allocators.online.routes.insertion import hours_of_work, insert, is_hopeless, place_between
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled, inlined

NOISE = 0.3
"""Share by which costs are blurred, so that no two rebuilt plans are the same."""


@compiled
def insert_cheapest(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, waiting: Ints, balance: float
) -> None:
    """Put tasks where one agent can do them in time, while there are such places; -1 in `waiting` for those put."""
    n, count = len(lengths), len(waiting)
    cost, place, leaves = np.empty((count, n)), np.empty((count, n), np.int64), np.empty((count, n))
    cheapest, blur = np.empty(count, np.int64), 1 + NOISE * np.random.random(count)
    is_bound = np.zeros((count, n), np.bool_)  # costs only rise as routes fill, so that earlier ones are bounds
    for k in range(count):
        for i in range(n):
            cost[k, i], place[k, i], leaves[k, i] = _best_of(s, r, routes, lengths, slack, i, waiting[k], balance)
        cheapest[k] = np.argmin(cost[k])
    while True:
        k = _least(s, waiting, cost, cheapest, blur)
        if k < 0:
            return
        i, j = cheapest[k], waiting[k]
        if is_bound[k, i]:
            cost[k, i], place[k, i], leaves[k, i] = _best_of(s, r, routes, lengths, slack, i, j, balance)
            is_bound[k, i], cheapest[k] = False, np.argmin(cost[k])
            continue
        at = place[k, i]
        insert(s, r, routes, lengths, slack, i, at, j, leaves[k, i])
        waiting[k] = -1
        for k in range(count):
            if waiting[k] >= 0 and cost[k, i] < np.inf:  # where there was no place there is none now
                is_bound[k, i] = True
                for p in range(at, at + 2):  # beside the new visit it may be nearer
                    beside, left = _cost_at(s, r, routes, lengths, slack, i, p, waiting[k], balance)
                    if beside < cost[k, i]:
                        cost[k, i], place[k, i], leaves[k, i], is_bound[k, i] = beside, p, left, False
                        if beside < cost[k, cheapest[k]]:
                            cheapest[k] = i


@compiled
def _least(s: Situation, waiting: Ints, cost: Floats, cheapest: Ints, blur: Floats) -> int:
    """Return which of those waiting has the least cost for its weight, -1 if none has a place."""
    best, best_k = np.inf, -1
    for k in range(len(waiting)):
        if waiting[k] >= 0:
            blurred = cost[k, cheapest[k]] * blur[k] / s.tasks[waiting[k]].weight
            if blurred < best:
                best, best_k = blurred, k
    return best_k


@compiled
def _best_of(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, j: int, balance: float
) -> tuple[float, int, float]:
    """Return what a task costs at least in a route, as which visit, and when it is left; ``inf`` if it has no place."""
    best, place, leaves, count = np.inf, -1, 0.0, lengths[i]
    if not s.allowed[i, j] or count >= routes.shape[1]:
        return best, place, leaves
    least = s.tasks[j].left / (s.agents[i].ability * s.pace)
    for p in range(count + 1):
        if p > 0 and r.leave[i, p - 1] + least > s.tasks[j].deadline:
            break
        if is_hopeless(s, r, lengths, slack, i, p, least):
            continue
        cost, left = _cost_at(s, r, routes, lengths, slack, i, p, j, balance)
        if cost < best:
            best, place, leaves = cost, p, left
    return best, place, leaves


@inlined
def _cost_at(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, p: int, j: int, balance: float
) -> tuple[float, float]:
    """Return what a task costs as one visit, and when it is left."""
    arrives, latest, detour = place_between(s, r, routes, lengths, slack, i, p, j)
    hours = hours_of_work(s, j, arrives, s.agents[i].ability)
    leaves = arrives + hours
    cost = hours + detour / s.agents[i].speed + balance * leaves
    if arrives >= s.tasks[j].deadline or leaves > s.tasks[j].deadline or leaves > latest:
        cost = np.inf
    return cost, leaves
