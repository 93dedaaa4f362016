"""Local search over routes: small changes, and tasks taken out near each other and put back where they fit best."""

import numpy as np

from alloc.allocators.online.routes.insertion import find_slack, insert_best, tidy
from alloc.allocators.online.routes.moves import change
from alloc.allocators.online.routes.schedule import Schedule, play
from alloc.allocators.online.routes.situation import Ints, Situation
from alloc.allocators.runtime.compiled import compiled

UNDONE = 1e4
"""What all tasks left undone would count, beside the mission time in units of the situation's scale."""

HOURS, FLIGHT, MISSED_HOURS, MISSED_FLIGHT = 0.02, 0.02, 0.02, 0.5
"""What hours to completion and hours of flight count beside: where all is done, and where something is missed."""

RUIN, BLINK, TOLERATED = 0.3, 0.02, 2e-3
"""Share of the changes that rebuild, share of the places passed over, and how much worse than the best plan may be."""

MOST_OUT, MOST_WAITING = 9, 30
"""Most tasks taken out at once, and most unplanned tasks tried with them."""


@compiled
def value(s: Situation, r: Schedule) -> float:
    """Return what a schedule is worth, less being better: undone weight, then time, then flights and switches."""
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
def rebuild(
    s: Situation, r: Schedule, nearest: Ints, routes: Ints, lengths: Ints, slack: np.ndarray, most: int
) -> None:
    """Take some tasks near each other out of all routes, and put them and unplanned tasks where they fit best."""
    m = len(s.tasks)
    out = np.zeros(m, np.bool_)
    if most > 0:
        seed = np.random.randint(m)
        wanted, taken = 1 + np.random.randint(most), 1
        out[seed] = True
        for k in range(nearest.shape[1]):
            if taken >= wanted:
                break
            if np.random.random() < 0.7:
                out[nearest[seed, k]] = True
                taken += 1
    planned = np.zeros(m, np.bool_)
    for i in range(len(lengths)):
        kept = 0
        for p in range(lengths[i]):
            if not out[routes[i, p]]:
                routes[i, kept] = routes[i, p]
                kept += 1
        lengths[i] = kept
    play(s, r, routes, lengths)
    tidy(r, routes, lengths)
    has_deadline = False
    for i in range(len(lengths)):
        find_slack(s, r, routes, lengths, slack, i)
        for p in range(lengths[i]):
            planned[routes[i, p]] = True
    waiting = np.empty(m, np.int64)
    key = np.empty(m)
    count, chance, order = 0, 1.0, np.random.randint(4)
    unplanned = 0
    for j in range(m):
        if not planned[j] and s.tasks[j].weight > 0:
            unplanned += 1
        if s.tasks[j].deadline < np.inf:
            has_deadline = True
    if most > 0 and unplanned > MOST_WAITING:
        chance = MOST_WAITING / unplanned
    for j in range(m):
        if planned[j] or s.tasks[j].weight <= 0 or (not out[j] and np.random.random() >= chance):
            continue
        waiting[count] = j
        draw = np.random.random()
        if order == 0:
            key[count] = draw
        elif order == 1:
            key[count] = s.tasks[j].deadline if has_deadline else -s.tasks[j].left
        elif order == 2:
            key[count] = s.tasks[j].left / s.tasks[j].weight * (0.5 + draw)
        else:
            key[count] = s.start_distance[np.random.randint(len(lengths)), j]
        count += 1
    balance = 0.02 if has_deadline else 1.0
    for k in np.argsort(key[:count]):
        insert_best(s, r, routes, lengths, slack, waiting[k], balance, BLINK)


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
    best = value(s, r)
    for step in range(-3 if is_new else 0, iterations):
        for i in range(n):
            trial_lengths[i] = now_lengths[i]
            trial[i, : now_lengths[i]] = now[i, : now_lengths[i]]
        if step < 0:
            rebuild(s, r, nearest, trial, trial_lengths, slack, 0)
        elif np.random.random() < RUIN:
            rebuild(s, r, nearest, trial, trial_lengths, slack, MOST_OUT)
        elif not change(s, r, nearest, trial, trial_lengths):
            continue
        play(s, r, trial, trial_lengths)
        reached = value(s, r)
        if reached < best + TOLERATED:
            tidy(r, trial, trial_lengths)
            now, trial = trial, now
            now_lengths, trial_lengths = trial_lengths, now_lengths
            if reached < best:
                best = reached
                lengths[:] = now_lengths
                for i in range(n):
                    routes[i, : lengths[i]] = now[i, : lengths[i]]
    return best
