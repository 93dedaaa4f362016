"""Local search over routes: small moves, and ruin and recreate of adjacent visits."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

import numpy as np

from alloc.allocators.online.routes.cheapest import insert_by_deadline, insert_cheapest
from alloc.allocators.online.routes.evaluation import copy_touched, play, replay
from alloc.allocators.online.routes.insertion import find_slack, insert_best, insert_coalition, tidy
from alloc.allocators.online.routes.moves import change
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Bools, Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled, compiled_in_place

UNDONE = 1e4
"""Cost of leaving all tasks undone, relative to mission time in units of the situation's scale."""

HOURS, FLIGHT, MISSED_HOURS, MISSED_BUSY = 0.02, 0.02, 0.02, 0.5
"""Weights of hours to completion and of flight if all tasks are done; weights of hours to completion, and of flight and
work, if some are missed: agents that finish earlier have time for more."""

RUIN, BLINK = 0.5, 0.02
"""Probability of a ruin-and-recreate step, and of skipping a position in insertion (blink)."""

BALANCE = 0.1
"""Weight of the end of a route, relative to the time a task takes from it, where tasks are inserted by deadline."""

SIZES = (0.0, 0.0, 6.0, 12.0)
"""Values of `size` that `insert_by_deadline` tries; with the first one, coalitions are sought at once."""

WAYS = len(SIZES) + 1
"""Number of ways to insert tasks, of which the last is by least cost per weight."""

Plan = tuple[Ints, Ints]
"""Routes and their lengths."""

MAX_REMOVED, MAX_NEAR, MAX_WAITING, MAX_MEETINGS, BY_TIME = 7, 10, 4, 2, 0.6
"""Limits on the visits of a removed segment, on unplanned tasks near it and elsewhere that are inserted with them, and
on tasks for which a coalition is sought; probability of removing by time rather than by distance."""


@compiled_in_place
def value(s: Situation, r: Schedule) -> float:
    """Return the cost of a schedule: undone weight, then time, then flights and switches."""
    n, undone = len(s.agents), max(0.0, r.totals[0])
    switches = 0
    for i in range(n):
        if s.agents[i].active and s.agents[i].aim >= 0 and r.agents[i].first != s.agents[i].aim:
            switches += 1
    cost = UNDONE * undone + s.price * switches + 1e-9 * r.totals[3]
    if undone < 1e-12 and not s.has_missed:
        time = max(0.0, r.totals[1] - s.hour) + HOURS * r.totals[2] + FLIGHT * r.totals[4] / n
    else:
        time = MISSED_HOURS * r.totals[2] + MISSED_BUSY * (r.totals[4] + r.totals[5]) / n
    return float(cost + time / s.scale)


@compiled_in_place
def _take_out(r: Schedule, nearest: Ints, routes: Ints, lengths: Ints, near: Ints) -> None:
    """Ruin: remove a segment of a route and other agents' visits at that time, or visits close to each other in space.

    `near` is set to 2 for tasks to be inserted again, and to 1 for tasks near one of them; otherwise it is unchanged.
    """
    i = np.random.randint(len(lengths))
    if lengths[i] == 0:
        return
    p = np.random.randint(lengths[i])
    seed, most = routes[i, p], 1 + np.random.randint(MAX_REMOVED)
    by_time = np.random.random() < BY_TIME
    begin, end = r.arrive[i, p], r.arrive[i, min(p + most, lengths[i]) - 1]
    share = 1.0 if np.random.random() < 0.5 else 0.3
    for k in range(nearest.shape[1]):
        near[nearest[seed, k]] = 2 if not by_time and k < most else 1
    for k in range(len(lengths)):
        is_in = k == i or np.random.random() < share * 2 / len(lengths)
        kept = 0
        for q in range(lengths[k]):
            j = routes[k, q]
            hour = r.arrive[k, q]
            if (by_time and is_in and begin <= hour <= end) or (not by_time and (near[j] == 2 or j == seed)):
                near[j] = 2
                for other in range(min(6, nearest.shape[1])):
                    near[nearest[j, other]] = max(1, near[nearest[j, other]])
            else:
                routes[k, kept] = j
                kept += 1
        lengths[k] = kept


@compiled
def rebuild(
    s: Situation, r: Schedule, nearest: Ints, plan: Plan, before: Plan, slack: Floats, fresh: Bools, is_partial: bool
) -> None:
    """Ruin and recreate: remove some visits, and insert these and unplanned tasks at their best positions.

    Parameters
    ----------
    s : Situation
    r : Schedule
        Schedule of the previous plan.
    nearest : ndarray of int, shape (m, k)
        Tasks near each task, nearest first.
    plan, before : tuple of ndarray
        Routes and their lengths, to be changed, and as they were.
    slack : ndarray, shape (n, c)
        Scratch.
    fresh : ndarray of bool, shape (m,)
        Tasks to insert if `is_partial` is false.
    is_partial : bool
        Whether to remove tasks and insert them again, together with some unplanned tasks near them.
    """
    routes, lengths = plan
    m = len(s.tasks)
    near = np.where(fresh, 1, 0)
    if is_partial:
        near[:] = 0
        _take_out(r, nearest, routes, lengths, near)
        replay(s, r, routes, lengths, *before)
        tidy(r, routes, lengths)
    for i in range(len(lengths)):
        find_slack(s, r, routes, lengths, slack, i)
    has_deadline = _has_deadline(s)
    waiting = _waiting(
        s, routes, lengths, near, has_deadline, MAX_WAITING if is_partial else 0, MAX_NEAR if is_partial else m
    )
    balance = 0.02 if has_deadline else 1.0
    alone = has_deadline and (not is_partial or np.random.random() < 0.5)
    if alone:
        insert_cheapest(s, r, routes, lengths, slack, waiting, balance)
    meetings = MAX_MEETINGS if is_partial else len(waiting)
    for j in waiting:
        if j < 0 or (not alone and insert_best(s, r, routes, lengths, slack, j, balance, BLINK)):
            continue
        if meetings > 0 and s.tasks[j].deadline < np.inf:
            meetings -= 1
            insert_coalition(s, r, routes, lengths, slack, j)


@compiled
def _waiting(
    s: Situation, routes: Ints, lengths: Ints, near: Ints, has_deadline: bool, others: int, most_near: int
) -> Ints:
    """Return unplanned tasks that are near, and some others, in a random or a heuristic order of insertion."""
    m = len(s.tasks)
    planned, waiting, key = np.zeros(m, np.bool_), np.empty(m, np.int64), np.empty(m)
    count = _gather(s, routes, lengths, near, has_deadline, others, most_near, planned, waiting, key)
    return waiting[:count][np.argsort(key[:count])]


@compiled_in_place
def _has_deadline(s: Situation) -> bool:
    for j in range(len(s.tasks)):  # noqa: SIM110 - compiled
        if s.tasks[j].deadline < np.inf:
            return True
    return False


@compiled_in_place
def _gather(
    s: Situation,
    routes: Ints,
    lengths: Ints,
    near: Ints,
    has_deadline: bool,
    others: int,
    most_near: int,
    planned: Bools,
    waiting: Ints,
    key: Floats,
) -> int:
    """Find the tasks for `_waiting`, each with a key by which they are to be sorted; return their number."""
    m = len(s.tasks)
    for i in range(len(lengths)):
        for p in range(lengths[i]):
            planned[routes[i, p]] = True
    beside = 0
    for j in range(m):
        beside += not planned[j] and near[j] == 1
    unplanned = m - planned.sum()
    count, order = 0, np.random.randint(4)
    chances = others / max(1, unplanned), most_near / max(1, beside), 1.0
    for j in range(m):
        if planned[j] or np.random.random() >= chances[near[j]]:
            continue
        waiting[count] = j
        draw = np.random.random()
        if order == 0:
            key[count] = draw
        elif order == 1:
            key[count] = s.tasks[j].deadline if has_deadline else -s.tasks[j].left
        else:
            key[count] = s.tasks[j].left / s.tasks[j].weight * (0.7 + 0.6 * draw)
            if not has_deadline:
                key[count] = -key[count]
        count += 1
    return count


@compiled
def _put_in(
    s: Situation,
    pair: tuple[Schedule, Schedule],
    nearest: Ints,
    plan: Plan,
    before: Plan,
    slack: Floats,
    fresh: Bools,
    ways: tuple[int, int],
) -> None:
    """Insert tasks into a plan in the best of several ways; the second schedule remains that of the plan before."""
    r, trial_r = pair
    routes, lengths = plan
    best, kept, kept_lengths = np.inf, routes.copy(), lengths.copy()
    waiting = np.flatnonzero(fresh)
    for way in range(ways[0], ways[1]):
        if way == len(SIZES):
            rebuild(s, trial_r, nearest, plan, before, slack, fresh, False)
        else:
            for i in range(len(lengths)):
                find_slack(s, trial_r, routes, lengths, slack, i)
            insert_by_deadline(s, trial_r, routes, lengths, slack, waiting, SIZES[way], BALANCE, way == 0)
        replay(s, trial_r, routes, lengths, *before)
        reached = value(s, trial_r)
        if reached < best:
            best = reached
            kept[:], kept_lengths[:] = routes, lengths
        copy_touched(trial_r, r, before[0], before[1], trial_r, routes, lengths)
    routes[:], lengths[:] = kept, kept_lengths


@compiled
def improve(
    s: Situation,
    pair: tuple[Schedule, Schedule],
    nearest: Ints,
    plan: Plan,
    iterations: int,
    seed: int,
    fresh: Bools,
    ways: tuple[int, int],
    tolerated: tuple[float, float],
) -> float:
    """Improve routes in place; return their cost.

    Parameters
    ----------
    s : Situation
    pair : tuple of Schedule
        Two schedules large enough for the routes.
    nearest : ndarray of int, shape (m, k)
        Tasks near each task, nearest first.
    plan : tuple of ndarray
        Routes, shape (n, c), and their lengths, shape (n,).
    iterations : int
        Number of changes to try.
    seed : int
    fresh : ndarray of bool, shape (m,)
        Tasks to insert into the routes first.
    ways : tuple of int
        Where there are deadlines, the ways of inserting them to try: the first one, and the one after the last.
    tolerated : tuple of float
        Relative amount by which an accepted plan may be worse than the best one, at the first and the last iteration.
    """
    np.random.seed(seed)
    r, trial_r = pair
    routes, lengths = plan
    slack = np.zeros(routes.shape)
    now, now_lengths = routes.copy(), lengths.copy()
    trial, trial_lengths = routes.copy(), lengths.copy()
    play(s, r, routes, lengths)
    play(s, trial_r, routes, lengths)
    copy_touched(trial_r, r, now, now_lengths, trial_r, trial, trial_lengths)
    best, undone = value(s, r), max(0.0, r.totals[0])
    has_deadline = np.isfinite(s.tasks["deadline"]).any()
    for step in range(-1 if fresh.any() else 0, iterations):
        if step < 0 and has_deadline and fresh.sum() > 1:
            _put_in(s, pair, nearest, (trial, trial_lengths), (now, now_lengths), slack, fresh, ways)
        elif step < 0 or np.random.random() < RUIN:
            rebuild(s, trial_r, nearest, (trial, trial_lengths), (now, now_lengths), slack, fresh, step >= 0)
        elif not change(s, r, nearest, trial, trial_lengths):
            continue
        replay(s, trial_r, trial, trial_lengths, now, now_lengths)
        share = tolerated[0] + (tolerated[1] - tolerated[0]) * max(0, step) / max(1, iterations)
        limit = best + share * (best - UNDONE * undone)
        reached = value(s, trial_r)
        while reached < limit and tidy(trial_r, trial, trial_lengths):
            replay(s, trial_r, trial, trial_lengths, now, now_lengths)
            reached = value(s, trial_r)
        if reached < limit:
            copy_touched(trial_r, trial_r, trial, trial_lengths, r, now, now_lengths)
            if reached < best:
                best, undone = reached, max(0.0, trial_r.totals[0])
                lengths[:] = now_lengths
                for i in range(len(lengths)):
                    routes[i, : lengths[i]] = now[i, : lengths[i]]
        else:
            copy_touched(trial_r, r, now, now_lengths, trial_r, trial, trial_lengths)
    return best
