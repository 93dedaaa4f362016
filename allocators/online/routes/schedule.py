"""The exact schedule of a plan of routes: who is where when, and what is done by then.

An agent flies to the next task of its route, works there until the task is over, and goes on. Whoever comes to a task
works with those who are there. A flight to a task that is done meanwhile is broken off. A task is left out of a route
where it is over, too far, or cannot be reached before its deadline.
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.online.routes.queue import drop_first, push
from alloc.allocators.online.routes.situation import (
    CANCELLED,
    CHANGED,
    CHARGED,
    IN,
    MANHATTAN,
    FIXED,
    OPENS,
    OUT,
    Bools,
    Floats,
    Ints,
    Situation,
)
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.distances.reach import TOLERANCE

IDLE, FLYING, PRESENT, AWAY = 0, 1, 2, 3
DONE, OVER = 1, 2
KIND = 1 << 40
"""Items of the queue are a kind times this, plus an index: completions, deadlines, events, arrivals."""


class Schedule(NamedTuple):
    """A schedule in the making, and what is recorded of it.

    Attributes
    ----------
    first : ndarray of int, shape (n,)
        Task to which each agent goes first, -1 for none.
    arrive, leave : ndarray, shape (n, c)
        Hours of each visit of the routes; NaN where there is none.
    finish : ndarray, shape (m,)
        Hour at which each task is done; ``inf`` if it is not.
    totals : ndarray, shape (5,)
        Weight of what is not done, hour of the last completion, weighted hours from appearance to completion, energy,
        hours of flight.
    """

    first: Ints
    arrive: Floats
    leave: Floats
    finish: Floats
    totals: Floats
    pointer: Ints
    target: Ints
    state: Ints
    node: Ints
    point: Floats
    fuel: Floats
    departs: Floats
    arrives: Floats
    way: Floats
    version: Ints
    following: Ints
    left: Floats
    since: Floats
    rate: Floats
    closed: Ints
    is_open: Bools
    begun: Bools
    edition: Ints
    head: Ints
    hours: Floats
    items: Ints
    versions: Ints


@compiled
def new_schedule(n: int, m: int, capacity: int, events: int) -> Schedule:
    """Return room for the schedules of plans of one size."""
    room = 2 * n * capacity + 3 * events + 2 * n + m + 16
    return Schedule(
        np.empty(n, np.int64),
        np.empty((n, capacity)),
        np.empty((n, capacity)),
        np.empty(m),
        np.empty(5),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty((n, 3)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n, np.int64),
        np.empty(n, np.int64),
        np.empty(m),
        np.empty(m),
        np.empty(m),
        np.empty(m, np.int64),
        np.empty(m, np.bool_),
        np.empty(m, np.bool_),
        np.empty(m, np.int64),
        np.empty(m, np.int64),
        np.empty(room),
        np.empty(room, np.int64),
        np.empty(room, np.int64),
    )


@compiled
def play(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> None:
    """Fill in the schedule of a plan.

    Parameters
    ----------
    s : Situation
    r : Schedule
        With room for it.
    routes : ndarray of int, shape (n, c)
        Tasks of each agent, in their order.
    lengths : ndarray of int, shape (n,)
    """
    size = _begin(s, r, routes, lengths)
    for i in range(len(s.ability)):
        r.first[i] = r.target[i]
    while size > 0 and r.hours[0] <= s.end:
        hour, item, version = r.hours[0], r.items[0], r.versions[0]
        size = drop_first(r.hours, r.items, r.versions, size)
        kind, index = item // KIND, item % KIND
        if kind == 3:
            if version == r.version[index]:
                size = _arrive(s, r, routes, lengths, index, hour, size)
        elif kind == 2:
            size = _happen(s, r, routes, lengths, index, hour, size)
        elif version == r.edition[index] and r.closed[index] == 0:
            size = _close(s, r, routes, lengths, index, DONE if kind == 0 else OVER, hour, size)


@compiled
def _begin(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> int:
    """Begin at the hour of the situation; return the size of the queue."""
    n, m, size = len(s.ability), len(s.left), 0
    r.totals[:] = 0.0
    for j in range(m):
        r.left[j], r.since[j], r.rate[j], r.closed[j] = s.left[j], s.hour, 0.0, 0
        r.is_open[j], r.begun[j], r.edition[j], r.head[j], r.finish[j] = s.is_open[j], s.begun[j], 0, -1, np.inf
        r.totals[0] += s.weight[j]
    for k in range(len(s.event_hour)):
        size = push(r.hours, r.items, r.versions, size, s.event_hour[k], 2 * KIND + k, 0)
    for i in range(n):
        r.pointer[i], r.target[i], r.node[i], r.fuel[i], r.version[i] = 0, -1, -1, s.battery[i], 0
        r.state[i] = IDLE if s.active[i] else AWAY
        for p in range(lengths[i]):
            r.arrive[i, p] = r.leave[i, p] = np.nan
    for i in range(n):
        if s.active[i] and lengths[i] > 0 and s.at[i] >= 0 and routes[i, 0] == s.at[i]:
            j = s.at[i]
            r.target[i], r.state[i], r.node[i], r.arrive[i, 0] = j, PRESENT, j, s.hour
            r.following[i], r.head[j] = r.head[j], i
            size = _join(s, r, i, j, s.hour, size)
    for i in range(n):
        if r.state[i] == IDLE:
            size = _depart(s, r, routes, lengths, i, max(s.hour, s.free[i]), size)
    return size


@compiled
def _distance(s: Situation, r: Schedule, i: int, j: int) -> float:
    node = r.node[i]
    if node == -1:
        return s.start_distance[i, j]
    if node >= 0:
        return s.distance[node, j]
    if np.isnan(s.site[j, 0]) or np.isnan(r.point[i, 0]):
        return 0.0
    x, y, z = r.point[i, 0] - s.site[j, 0], r.point[i, 1] - s.site[j, 1], r.point[i, 2] - s.site[j, 2]
    return abs(x) + abs(y) + abs(z) if s.metric == MANHATTAN else np.sqrt(x * x + y * y + z * z)


@compiled
def _depart(s: Situation, r: Schedule, routes: Ints, lengths: Ints, i: int, hour: float, size: int) -> int:
    """Let an agent go to the next task of its route that it can do; return the size of the queue."""
    while r.pointer[i] < lengths[i]:
        j = routes[i, r.pointer[i]]
        if r.closed[j] == 0 and s.allowed[i, j]:
            way = _distance(s, r, i, j)
            arrives = hour + way / s.speed[i]
            needed = s.consumption[i] * (way + s.home[j, i])
            if way <= s.reach[i] + TOLERANCE and needed <= r.fuel[i] + TOLERANCE and arrives < s.deadline[j]:
                r.target[i], r.state[i], r.way[i] = j, FLYING, way
                r.departs[i], r.arrives[i] = hour, arrives
                r.version[i] += 1
                r.following[i], r.head[j] = r.head[j], i
                return push(r.hours, r.items, r.versions, size, arrives, 3 * KIND + i, r.version[i])
        r.pointer[i] += 1
    r.target[i], r.state[i] = -1, IDLE
    return size


@compiled
def _land(s: Situation, r: Schedule, i: int, hour: float) -> bool:
    """End a flight where the agent is, if it can be ended there; return whether it is."""
    j = r.target[i]
    length = r.arrives[i] - r.departs[i]
    share = 1.0 if length <= 0 or hour >= r.arrives[i] else max(0.0, (hour - r.departs[i]) / length)
    if share < 1 and s.metric == FIXED:
        return False
    r.fuel[i] -= s.consumption[i] * share * r.way[i]
    r.totals[3] += s.consumption[i] * share * r.way[i]
    r.totals[4] += share * length
    if share == 1:
        r.node[i] = j
    elif share > 0:
        for axis in range(3):
            node = r.node[i]
            begin = s.place[i, axis] if node == -1 else (s.site[node, axis] if node >= 0 else r.point[i, axis])
            r.point[i, axis] = begin + share * (s.site[j, axis] - begin)
        r.node[i] = -2
    r.version[i] += 1
    return True


@compiled
def _arrive(s: Situation, r: Schedule, routes: Ints, lengths: Ints, i: int, hour: float, size: int) -> int:
    j = r.target[i]
    _land(s, r, i, hour)
    if r.closed[j] != 0:
        r.pointer[i] += 1
        return _depart(s, r, routes, lengths, i, hour, size)
    r.state[i] = PRESENT
    r.arrive[i, r.pointer[i]] = hour
    return _join(s, r, i, j, hour, size) if r.is_open[j] else size


@compiled
def _update(s: Situation, r: Schedule, j: int, hour: float) -> None:
    if r.is_open[j] and not r.begun[j]:
        r.left[j] += s.growth[j] * (hour - r.since[j])
    elif r.is_open[j]:
        r.left[j] = max(0.0, r.left[j] - r.rate[j] * (hour - r.since[j]))
    r.since[j] = hour


@compiled
def _join(s: Situation, r: Schedule, i: int, j: int, hour: float, size: int) -> int:
    _update(s, r, j, hour)
    r.begun[j] = True
    r.rate[j] += s.ability[i] * s.pace
    return _announce(s, r, j, hour, size)


@compiled
def _announce(s: Situation, r: Schedule, j: int, hour: float, size: int) -> int:
    """Put the end of a task's work into the queue, or its deadline where that comes first."""
    r.edition[j] += 1
    end = hour + r.left[j] / r.rate[j] if r.rate[j] > 0 else np.inf
    is_missed = end > s.deadline[j]
    end = min(end, s.deadline[j])
    if end == np.inf:
        return size
    return push(r.hours, r.items, r.versions, size, end, (KIND if is_missed else 0) + j, r.edition[j])


@compiled
def _close(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, j: int, how: int, hour: float, size: int
) -> int:
    """End a task; all who are there or on their way go on."""
    r.closed[j] = how
    if how == DONE:
        r.finish[j] = hour
        r.totals[0] -= s.weight[j]
        r.totals[1] = max(r.totals[1], hour)
        r.totals[2] += s.weight[j] * (hour - s.appears[j])
    i = r.head[j]
    r.head[j] = -1
    while i >= 0:
        after = r.following[i]
        if r.state[i] == PRESENT:
            r.leave[i, r.pointer[i]] = hour
            r.pointer[i] += 1
            size = _depart(s, r, routes, lengths, i, hour, size)
        elif _land(s, r, i, hour):
            r.pointer[i] += 1
            size = _depart(s, r, routes, lengths, i, hour, size)
        i = after
    return size


@compiled
def _happen(s: Situation, r: Schedule, routes: Ints, lengths: Ints, k: int, hour: float, size: int) -> int:
    """Let happen what is known to come."""
    kind, index = s.event_kind[k], s.event_index[k]
    if kind == CHARGED:
        r.fuel[index] += s.event_amount[k]
    elif kind == OUT:
        return _leave(s, r, index, hour, size)
    elif kind == IN:
        if r.state[index] == AWAY:
            return _depart(s, r, routes, lengths, index, hour, size)
    elif r.closed[index] != 0:
        return size
    elif kind == CANCELLED:
        r.totals[0] -= s.weight[index]
        return _close(s, r, routes, lengths, index, OVER, hour, size)
    else:
        return _change(s, r, routes, lengths, k, hour, size)
    return size


@compiled
def _change(s: Situation, r: Schedule, routes: Ints, lengths: Ints, k: int, hour: float, size: int) -> int:
    """Let a task open, or its work change."""
    j = s.event_index[k]
    _update(s, r, j, hour)
    if s.event_kind[k] == OPENS:
        r.is_open[j] = True
        r.left[j] = s.left[j]
        i = r.head[j]
        while i >= 0:
            if r.state[i] == PRESENT:
                size = _join(s, r, i, j, hour, size)
            i = r.following[i]
    else:
        r.left[j] = s.event_amount[k]
    if r.left[j] == 0:
        return _close(s, r, routes, lengths, j, DONE, hour, size)
    return _announce(s, r, j, hour, size)


@compiled
def _leave(s: Situation, r: Schedule, i: int, hour: float, size: int) -> int:
    """Let an agent leave the mission, for good or for a while."""
    j = r.target[i]
    if j >= 0 and r.closed[j] != 0:  # on a way to a task that is over
        r.version[i] += 1
    elif j >= 0:
        if r.head[j] == i:
            r.head[j] = r.following[i]
        else:
            before = r.head[j]
            while r.following[before] != i:
                before = r.following[before]
            r.following[before] = r.following[i]
        if r.state[i] == FLYING:
            if not _land(s, r, i, hour):
                r.version[i] += 1
        elif r.is_open[j]:
            _update(s, r, j, hour)
            r.rate[j] -= s.ability[i] * s.pace
            if r.rate[j] < 1e-12:
                r.rate[j] = 0.0
            size = _announce(s, r, j, hour, size)
    r.target[i], r.state[i] = -1, AWAY
    return size
