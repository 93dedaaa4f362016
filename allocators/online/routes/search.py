"""Local search over routes: small changes, and tasks taken out near each other and put back where they fit best."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

import numpy as np

from alloc.allocators.online.routes.cheapest import insert_cheapest
from alloc.allocators.online.routes.insertion import find_slack, insert_best, tidy
from alloc.allocators.online.routes.moves import change
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.schedule import play
from alloc.allocators.online.routes.situation import Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled

UNDONE = 1e4
"""What all tasks left undone would count, beside the mission time in units of the situation's scale."""

HOURS, FLIGHT, MISSED_HOURS, MISSED_FLIGHT = 0.02, 0.02, 0.02, 0.5
"""What hours to completion and hours of flight count beside: where all is done, and where something is missed."""

RUIN, BLINK, TOLERATED = 0.5, 0.02, 0.05
"""Share of the changes that rebuild, share of the places passed over, by what share a plan may be worse at first."""

MOST_OUT, MOST_WAITING, BY_TIME = 7, 8, 0.6
"""Most tasks of a stretch, unplanned tasks tried with those near it, and share of the stretches in time."""


@compiled
def value(s: Situation, r: Schedule) -> float:
    """Return the value of a schedule, less being better: undone weight, then time, then flights and switches."""
    n, undone = len(s.agents), max(0.0, r.totals[0])
    switches = 0
    for i in range(n):
        if s.agents[i].active and s.agents[i].aim >= 0 and r.agents[i].first != s.agents[i].aim:
            switches += 1
    cost = UNDONE * undone + s.price * switches + 1e-9 * r.totals[3]
    if undone < 1e-12 and not s.has_missed:
        time = max(0.0, r.totals[1] - s.hour) + HOURS * r.totals[2] + FLIGHT * r.totals[4] / n
    else:
        time = MISSED_HOURS * r.totals[2] + MISSED_FLIGHT * r.totals[4] / n
    return cost + time / s.scale


@compiled
def _take_out(r: Schedule, nearest: Ints, routes: Ints, lengths: Ints, near: Ints) -> None:
    """Take out a stretch of a route and what others do at that time, or tasks near each other in space.

    `near` is set to 1 for tasks that are taken out or lie near one of those, for all others it is left as it is.
    """
    i = np.random.randint(len(lengths))
    if lengths[i] == 0:
        return
    p = np.random.randint(lengths[i])
    seed, most = routes[i, p], 1 + np.random.randint(MOST_OUT)
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
    s: Situation, r: Schedule, nearest: Ints, routes: Ints, lengths: Ints, slack: Floats, is_partial: bool
) -> None:
    """Take some tasks out of all routes, and put them and unplanned tasks where they fit best."""
    m = len(s.tasks)
    near, planned = np.zeros(m, np.int64), np.zeros(m, np.bool_)
    if is_partial:
        play(s, r, routes, lengths)
        tidy(r, routes, lengths)
        _take_out(r, nearest, routes, lengths, near)
    play(s, r, routes, lengths)
    tidy(r, routes, lengths)
    for i in range(len(lengths)):
        find_slack(s, r, routes, lengths, slack, i)
        for p in range(lengths[i]):
            planned[routes[i, p]] = True
    has_deadline, unplanned = False, 0
    for j in range(m):
        unplanned += not planned[j] and near[j] != 2
        has_deadline = has_deadline or s.tasks[j].deadline < np.inf
    chance = min(1.0, MOST_WAITING / max(1, unplanned)) if is_partial else 1.0
    waiting, key = np.empty(m, np.int64), np.empty(m)
    count, order = 0, np.random.randint(4)
    for j in range(m):
        if planned[j] or (near[j] == 0 and np.random.random() >= chance):
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
    balance = 0.02 if has_deadline else 1.0
    waiting = waiting[:count][np.argsort(key[:count])]
    if has_deadline and (not is_partial or np.random.random() < 0.5):
        insert_cheapest(s, r, routes, lengths, slack, waiting, balance)
    for j in waiting:
        if j >= 0:
            insert_best(s, r, routes, lengths, slack, j, balance, BLINK)


@compiled
def improve(
    s: Situation, r: Schedule, nearest: Ints, routes: Ints, lengths: Ints, iterations: int, seed: int, is_new: bool
) -> float:
    """Improve routes in place; return their value.

    Parameters
    ----------
    s : Situation
    r : Schedule
        With room for the routes.
    nearest : ndarray of int, shape (m, k)
        Tasks near each task, nearest first.
    routes : ndarray of int, shape (n, c)
    lengths : ndarray of int, shape (n,)
    iterations : int
        Changes that are tried.
    seed : int
    is_new : bool
        Whether tasks without a place are to be put into the routes first.
    """
    np.random.seed(seed)
    n = len(s.agents)
    slack = np.zeros(routes.shape)
    now, now_lengths = routes.copy(), lengths.copy()
    trial, trial_lengths = routes.copy(), lengths.copy()
    play(s, r, routes, lengths)
    best, undone = value(s, r), max(0.0, r.totals[0])
    for step in range(-1 if is_new else 0, iterations):
        for i in range(n):
            trial_lengths[i] = now_lengths[i]
            trial[i, : now_lengths[i]] = now[i, : now_lengths[i]]
        if step < 0:
            rebuild(s, r, nearest, trial, trial_lengths, slack, False)
        elif np.random.random() < RUIN:
            rebuild(s, r, nearest, trial, trial_lengths, slack, True)
        elif not change(s, r, nearest, trial, trial_lengths):
            continue
        play(s, r, trial, trial_lengths)
        reached = value(s, r)
        share = TOLERATED * (1 - max(0, step) / max(1, iterations))
        if reached < best + share * (best - UNDONE * undone):
            tidy(r, trial, trial_lengths)
            now, trial = trial, now
            now_lengths, trial_lengths = trial_lengths, now_lengths
            if reached < best:
                best, undone = reached, max(0.0, r.totals[0])
                lengths[:] = now_lengths
                for i in range(n):
                    routes[i, : lengths[i]] = now[i, : lengths[i]]
    return best
