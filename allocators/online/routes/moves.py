"""Neighbourhood moves on routes: move, swap, add or drop visits, exchange tails, reverse segments."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

import numpy as np

from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Ints, Situation
from alloc.allocators.runtime.compiled import compiled_in_place

MOVES = 8

AGAIN = 0.3
"""Probability of one more move: some plans can be reached only through worse ones."""


@compiled_in_place
def change(s: Situation, r: Schedule, nearest: Ints, routes: Ints, lengths: Ints) -> bool:
    """Make one or a few random moves; return whether the plan has changed.

    Parameters
    ----------
    s : Situation
    r : Schedule
        Schedule of the routes before the moves.
    nearest : ndarray of int, shape (m, k)
        Tasks near each task, nearest first.
    routes : ndarray of int, shape (n, c)
    lengths : ndarray of int, shape (n,)
    """
    is_changed = False
    while True:
        is_changed = _change_once(s, r, nearest, routes, lengths) or is_changed
        if np.random.random() >= AGAIN:
            return is_changed


@compiled_in_place
def _change_once(s: Situation, r: Schedule, nearest: Ints, routes: Ints, lengths: Ints) -> bool:
    n = len(lengths)
    i, p = _random_visit(lengths)
    if i < 0:
        return False
    kind = np.random.randint(MOVES)
    j = routes[i, p]
    other = np.random.randint(n)
    if kind <= 1:  # move next to a nearby task
        beside, q = _visit_of(routes, lengths, nearest[j, np.random.randint(nearest.shape[1])])
        if beside < 0:
            return False
        return _move(s, routes, lengths, i, p, beside, q + np.random.randint(2))
    if kind == 2:
        return _move(s, routes, lengths, i, p, other, np.random.randint(lengths[other] + 1))
    if kind == 3:  # swap
        k, q = _random_visit(lengths)
        other_j = routes[k, q]
        if j == other_j or not s.allowed[i, other_j] or not s.allowed[k, j]:
            return False
        if i != k and (_has(routes, lengths, i, other_j) or _has(routes, lengths, k, j)):
            return False
        routes[i, p], routes[k, q] = other_j, j
        return True
    if kind == 4:
        return _swap_tails(routes, lengths, i, p, other)
    if kind == 5:  # join
        if np.random.random() < 0.5:
            j = _latest(r, routes, lengths)
        return _add(s, routes, lengths, other, np.random.randint(lengths[other] + 1), j)
    if kind == 6:  # drop
        _remove(routes, lengths, i, p)
        return True
    q = p + 1 + np.random.randint(min(4, lengths[i]))
    if q >= lengths[i]:
        return False
    while p < q:
        routes[i, p], routes[i, q] = routes[i, q], routes[i, p]
        p, q = p + 1, q - 1
    return True


@compiled_in_place
def _random_visit(lengths: Ints) -> tuple[int, int]:
    total = lengths.sum()
    if total == 0:
        return -1, -1
    number = np.random.randint(total)
    for i in range(len(lengths)):
        if number < lengths[i]:
            return i, number
        number -= lengths[i]
    return -1, -1


@compiled_in_place
def _visit_of(routes: Ints, lengths: Ints, j: int) -> tuple[int, int]:
    for i in range(len(lengths)):
        for p in range(lengths[i]):
            if routes[i, p] == j:
                return i, p
    return -1, -1


@compiled_in_place
def _has(routes: Ints, lengths: Ints, i: int, j: int) -> bool:
    for p in range(lengths[i]):  # noqa: SIM110 - compiled
        if routes[i, p] == j:
            return True
    return False


@compiled_in_place
def _latest(r: Schedule, routes: Ints, lengths: Ints) -> int:
    """Return the task that is done last."""
    last, hour = routes[0, 0], -np.inf
    for i in range(len(lengths)):
        for p in range(lengths[i]):
            finish = r.tasks[routes[i, p]].finish
            if finish > hour:
                last, hour = routes[i, p], finish
    return int(last)


@compiled_in_place
def _remove(routes: Ints, lengths: Ints, i: int, p: int) -> None:
    for q in range(p, lengths[i] - 1):
        routes[i, q] = routes[i, q + 1]
    lengths[i] -= 1


@compiled_in_place
def _add(s: Situation, routes: Ints, lengths: Ints, i: int, p: int, j: int) -> bool:
    if not s.allowed[i, j] or lengths[i] >= routes.shape[1] or _has(routes, lengths, i, j):
        return False
    p = min(p, lengths[i])
    for q in range(lengths[i], p, -1):
        routes[i, q] = routes[i, q - 1]
    routes[i, p] = j
    lengths[i] += 1
    return True


@compiled_in_place
def _move(s: Situation, routes: Ints, lengths: Ints, i: int, p: int, k: int, q: int) -> bool:
    j = routes[i, p]
    if i == k:
        if q in (p, p + 1):
            return False
        _remove(routes, lengths, i, p)
        return _add(s, routes, lengths, i, q - 1 if q > p else q, j)
    if not _add(s, routes, lengths, k, q, j):
        return False
    _remove(routes, lengths, i, p)
    return True


@compiled_in_place
def _swap_tails(routes: Ints, lengths: Ints, i: int, p: int, k: int) -> bool:
    if i == k:
        return False
    q = np.random.randint(lengths[k] + 1)
    ours, theirs = lengths[i] - p, lengths[k] - q
    if p + theirs > routes.shape[1] or q + ours > routes.shape[1]:
        return False
    for step in range(max(ours, theirs)):
        routes[i, p + step], routes[k, q + step] = routes[k, q + step], routes[i, p + step]
    lengths[i], lengths[k] = p + theirs, q + ours
    return True
