"""Tasks put into routes one by one, always the one that takes least time for its weight."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

import numpy as np

from alloc.allocators.online.routes.insertion import hours_of_work, insert, is_hopeless, place_between
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled

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
    for k in range(count):
        for i in range(n):
            cost[k, i], place[k, i], leaves[k, i] = _best_of(s, r, routes, lengths, slack, i, waiting[k], balance)
        cheapest[k] = np.argmin(cost[k])
    while True:
        best, best_k = np.inf, -1
        for k in range(count):
            if waiting[k] >= 0:
                blurred = cost[k, cheapest[k]] * blur[k] / s.tasks[waiting[k]].weight
                if blurred < best:
                    best, best_k = blurred, k
        if best_k < 0:
            return
        i = cheapest[best_k]
        insert(s, r, routes, lengths, slack, i, place[best_k, i], waiting[best_k], leaves[best_k, i])
        waiting[best_k] = -1
        for k in range(count):
            if waiting[k] >= 0 and cost[k, i] < np.inf:  # where there was no place there is none now
                cost[k, i], place[k, i], leaves[k, i] = _best_of(s, r, routes, lengths, slack, i, waiting[k], balance)
                cheapest[k] = np.argmin(cost[k])


@compiled
def _best_of(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, j: int, balance: float
) -> tuple[float, int, float]:
    """Return what a task costs at least in a route, as which visit, and when it is left; ``inf`` if it has no place."""
    best, place, left, count = np.inf, -1, 0.0, lengths[i]
    if not s.allowed[i, j] or count >= routes.shape[1]:
        return best, place, left
    least = s.tasks[j].left / (s.agents[i].ability * s.pace)
    for p in range(count + 1):
        if is_hopeless(s, r, lengths, slack, i, p, least):
            continue
        arrives, latest, detour = place_between(s, r, routes, lengths, slack, i, p, j)
        if arrives >= s.tasks[j].deadline:
            if arrives < np.inf:
                break
            continue
        hours = hours_of_work(s, j, arrives, s.agents[i].ability)
        leaves = arrives + hours
        if leaves > s.tasks[j].deadline or leaves > latest:
            continue
        cost = hours + detour / s.agents[i].speed + balance * leaves
        if cost < best:
            best, place, left = cost, p, leaves
    return best, place, left
