"""Greedy insertion of tasks into routes: next is the task with the least cost per weight, or the earliest deadline."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

from typing import NamedTuple

import numpy as np

from alloc.allocators.online.routes.insertion import (
    hours_of_work,
    insert,
    insert_best,
    insert_coalition,
    is_hopeless,
    place_between,
)
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Bools, Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled, compiled_in_place, inlined

NOISE = 0.3
"""Largest relative random noise on costs, which diversifies rebuilt plans."""


@compiled
def insert_cheapest(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, waiting: Ints, balance: float
) -> None:
    """Insert tasks that a single agent can do in time, while there are any; set inserted ones to -1 in `waiting`."""
    n, count = len(lengths), len(waiting)
    cost, place, leaves = np.empty((count, n)), np.empty((count, n), np.int64), np.empty((count, n))
    cheapest, blur = np.empty(count, np.int64), 1 + NOISE * np.random.random(count)
    is_bound = np.zeros((count, n), np.bool_)
    options = Options(cost, place, leaves, cheapest, blur, is_bound)
    _insert_cheapest(s, r, routes, lengths, slack, waiting, balance, options)


class Options(NamedTuple):
    """The best insertion of each of `k` tasks into the route of each of `n` agents.

    Attributes
    ----------
    cost, place, leaves : ndarray, shape (k, n)
        Cost, position, and hour of leaving the task.
    cheapest : ndarray of int, shape (k,)
        Agent with the least cost.
    blur : ndarray, shape (k,)
        Random factor on the costs of each task.
    is_bound : ndarray of bool, shape (k, n)
        Whether the cost is that of an earlier plan; as costs only rise while routes fill, it is a lower bound.
    """

    cost: Floats
    place: Ints
    leaves: Floats
    cheapest: Ints
    blur: Floats
    is_bound: Bools


@compiled_in_place
def _insert_cheapest(
    s: Situation,
    r: Schedule,
    routes: Ints,
    lengths: Ints,
    slack: Floats,
    waiting: Ints,
    balance: float,
    options: Options,
) -> None:
    n, count = len(lengths), len(waiting)
    cost, place, leaves, cheapest, blur, is_bound = options
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
            if waiting[k] >= 0 and cost[k, i] < np.inf:  # infeasible insertions stay infeasible
                is_bound[k, i] = True
                for p in range(at, at + 2):  # next to the new visit it may be cheaper
                    beside, left = _cost_at(s, r, routes, lengths, slack, i, p, waiting[k], balance)
                    if beside < cost[k, i]:
                        cost[k, i], place[k, i], leaves[k, i], is_bound[k, i] = beside, p, left, False
                        if beside < cost[k, cheapest[k]]:
                            cheapest[k] = i


@compiled_in_place
def _least(s: Situation, waiting: Ints, cost: Floats, cheapest: Ints, blur: Floats) -> int:
    """Return the index in `waiting` of the task with the least noisy cost per weight, -1 if none can be inserted."""
    best, best_k = np.inf, -1
    for k in range(len(waiting)):
        if waiting[k] >= 0:
            blurred = cost[k, cheapest[k]] * blur[k] / s.tasks[waiting[k]].weight
            if blurred < best:
                best, best_k = blurred, k
    return best_k


@compiled_in_place
def _best_of(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, j: int, balance: float
) -> tuple[float, int, float]:
    """Return the least cost of a task in a route, its position, and the hour of leaving it; ``inf`` if infeasible."""
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
    """Return the cost of a task at position `p` of a route, and the hour of leaving it."""
    arrives, latest, detour = place_between(s, r, routes, lengths, slack, i, p, j)
    hours = hours_of_work(s, j, arrives, s.agents[i].ability)
    leaves = arrives + hours
    cost = hours + detour / s.agents[i].speed + balance * leaves
    if arrives >= s.tasks[j].deadline or leaves > s.tasks[j].deadline or leaves > latest:
        cost = np.inf
    return cost, leaves


@compiled
def insert_by_deadline(
    s: Situation,
    r: Schedule,
    routes: Ints,
    lengths: Ints,
    slack: Floats,
    waiting: Ints,
    size: float,
    balance: float,
    meets_at_once: bool,
) -> None:
    """Insert tasks that one agent can do in time, in order of their deadlines; then seek coalitions for the others.

    Parameters
    ----------
    waiting : ndarray of int, shape (k,)
        The tasks.
    size : float
        Multiple of the hours of work for one agent that is added to the deadline of a task, so that large tasks, which
        take the time of several small ones, come later.
    balance : float
        As for `insert_best`.
    meets_at_once : bool
        Whether a coalition is sought before later tasks are inserted, which suits many agents.
    """
    ability, weight = np.mean(s.agents["ability"]) * s.pace, 1.0 / len(s.tasks)
    key = np.empty(len(waiting))
    for k in range(len(waiting)):
        task = s.tasks[waiting[k]]
        key[k] = task.deadline + size * task.left / ability * weight / task.weight
    order = waiting[np.argsort(key)]
    for k in range(len(order)):
        if insert_best(s, r, routes, lengths, slack, order[k], balance, 0.0):
            order[k] = -1
        elif meets_at_once and s.tasks[order[k]].deadline < np.inf:
            insert_coalition(s, r, routes, lengths, slack, order[k])
            order[k] = -1
    for k in range(len(order)):
        if order[k] >= 0 and s.tasks[order[k]].deadline < np.inf:
            insert_coalition(s, r, routes, lengths, slack, order[k])
