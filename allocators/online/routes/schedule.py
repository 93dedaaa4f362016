"""Exact schedule of a route plan, by discrete-event simulation.

An agent flies to the next task of its route, works there until the task is closed, and goes on to the next. Agents at
the same task work together. A flight to a task that is closed meanwhile is broken off. An agent skips tasks that are
closed, out of its reach, or cannot be reached before their deadline.
"""

import numpy as np

from alloc.allocators.online.routes.flights import AWAY, FLYING, IDLE, KIND, PRESENT, depart, land
from alloc.allocators.online.routes.queue import drop_first, push
from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import CANCELLED, CHARGED, IN, OPENS, OUT, Ints, Situation
from alloc.allocators.runtime.compiled import compiled_in_place, inlined

DONE, OVER, GONE = 1, 2, 3
"""How a task is closed: done, missed, cancelled."""


@compiled_in_place
def play_touched(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> None:
    """Compute the schedule of the agents and tasks marked as touched, which must share no task with other agents.

    Parameters
    ----------
    s : Situation
    r : Schedule
        Updated in place.
    routes : ndarray of int, shape (n, c)
        Tasks of each agent, in order.
    lengths : ndarray of int, shape (n,)
    """
    size = _begin(s, r, routes, lengths)
    while size > 0 and r.queue[0].hour <= s.end:
        hour, item, version = r.queue[0].hour, r.queue[0].item, r.queue[0].version
        size = drop_first(r.queue, size)
        kind, index = item // KIND, item % KIND
        if kind == 3:
            if version == r.agents[index].version:
                size = _arrive(s, r, routes, lengths, index, hour, size)
        elif kind == 2:
            size = _happen(s, r, routes, lengths, index, hour, size)
        elif version == r.tasks[index].edition and r.tasks[index].closed == 0:
            size = _close(s, r, routes, lengths, index, DONE if kind == 0 else OVER, hour, size)


@compiled_in_place
def _begin(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> int:
    """Initialise the simulation at the hour of the situation; return the size of the queue."""
    n, size = len(s.agents), 0
    for j in range(len(s.tasks)):
        if r.tasks[j].touched:
            r.tasks[j].left, r.tasks[j].since, r.tasks[j].rate, r.tasks[j].closed = s.tasks[j].left, s.hour, 0.0, 0
            r.tasks[j].is_open, r.tasks[j].begun = s.tasks[j].is_open, s.tasks[j].begun
            r.tasks[j].edition, r.tasks[j].head, r.tasks[j].finish = 0, -1, np.inf
    for k in range(len(s.events)):
        kind, index = s.events[k].kind, s.events[k].index
        if r.agents[index].touched if kind < OPENS else r.tasks[index].touched:
            size = push(r.queue, size, s.events[k].hour, 2 * KIND + k, 0)
    for i in range(n):
        if r.agents[i].touched:
            r.agents[i].pointer, r.agents[i].target, r.agents[i].node, r.agents[i].version = 0, -1, -1, 0
            r.agents[i].fuel, r.agents[i].energy, r.agents[i].hours = s.agents[i].battery, 0.0, 0.0
            r.agents[i].works = 0.0
            r.agents[i].state = IDLE if s.agents[i].active else AWAY
            for p in range(lengths[i]):
                r.arrive[i, p] = r.leave[i, p] = np.nan
    for i in range(n):
        if r.agents[i].touched and is_at_first(s, routes, lengths, i):
            j = s.agents[i].at
            r.agents[i].target, r.agents[i].state, r.agents[i].node, r.arrive[i, 0] = j, PRESENT, j, s.hour
            r.agents[i].following, r.tasks[j].head = r.tasks[j].head, i
            size = _join(s, r, i, j, s.hour, size)
    for i in range(n):
        if r.agents[i].touched:
            if r.agents[i].state == IDLE:
                size = depart(s, r, routes, lengths, i, max(s.hour, s.agents[i].free), size)
            r.agents[i].first = r.agents[i].target
    return size


@inlined
def is_at_first(s: Situation, routes: Ints, lengths: Ints, i: int) -> bool:
    """Return whether an agent already works at the first task of its route."""
    return bool(s.agents[i].active and lengths[i] > 0 and s.agents[i].at >= 0 and routes[i, 0] == s.agents[i].at)


@compiled_in_place
def _arrive(s: Situation, r: Schedule, routes: Ints, lengths: Ints, i: int, hour: float, size: int) -> int:
    j = r.agents[i].target
    land(s, r, i, hour)
    if r.tasks[j].closed != 0:
        r.agents[i].pointer += 1
        return depart(s, r, routes, lengths, i, hour, size)
    r.agents[i].state = PRESENT
    r.arrive[i, r.agents[i].pointer] = hour
    return _join(s, r, i, j, hour, size) if r.tasks[j].is_open else size


@inlined
def _update(s: Situation, r: Schedule, j: int, hour: float) -> None:
    if r.tasks[j].is_open and not r.tasks[j].begun:
        r.tasks[j].left += s.tasks[j].growth * (hour - r.tasks[j].since)
    elif r.tasks[j].is_open:
        r.tasks[j].left = max(0.0, r.tasks[j].left - r.tasks[j].rate * (hour - r.tasks[j].since))
    r.tasks[j].since = hour


@inlined
def _join(s: Situation, r: Schedule, i: int, j: int, hour: float, size: int) -> int:
    _update(s, r, j, hour)
    r.tasks[j].begun = True
    r.tasks[j].rate += s.agents[i].ability * s.pace
    return _announce(s, r, j, hour, size)


@inlined
def _announce(s: Situation, r: Schedule, j: int, hour: float, size: int) -> int:
    """Queue the completion of a task, or its deadline if that comes first."""
    r.tasks[j].edition += 1
    end = hour + r.tasks[j].left / r.tasks[j].rate if r.tasks[j].rate > 0 else np.inf
    is_missed = end > s.tasks[j].deadline
    end = min(end, s.tasks[j].deadline)
    if end == np.inf:
        return size
    return push(r.queue, size, end, (KIND if is_missed else 0) + j, r.tasks[j].edition)


@compiled_in_place
def _close(s: Situation, r: Schedule, routes: Ints, lengths: Ints, j: int, how: int, hour: float, size: int) -> int:
    """Close a task; agents that are there or on their way go on to their next one."""
    r.tasks[j].closed = how
    if how == DONE:
        r.tasks[j].finish = hour
        r.totals[0] -= s.tasks[j].weight
    i = r.tasks[j].head
    r.tasks[j].head = -1
    while i >= 0:
        after = r.agents[i].following
        if r.agents[i].state == PRESENT:
            r.leave[i, r.agents[i].pointer] = hour
            r.agents[i].works += hour - r.arrive[i, r.agents[i].pointer]
            r.agents[i].pointer += 1
            size = depart(s, r, routes, lengths, i, hour, size)
        elif land(s, r, i, hour):
            r.agents[i].pointer += 1
            size = depart(s, r, routes, lengths, i, hour, size)
        i = after
    return size


@compiled_in_place
def _happen(s: Situation, r: Schedule, routes: Ints, lengths: Ints, k: int, hour: float, size: int) -> int:
    """Apply a known future event."""
    kind, index = s.events[k].kind, s.events[k].index
    if kind == CHARGED:
        r.agents[index].fuel += s.events[k].amount
    elif kind == OUT:
        return _leave(s, r, index, hour, size)
    elif kind == IN:
        if r.agents[index].state == AWAY:
            return depart(s, r, routes, lengths, index, hour, size)
    elif r.tasks[index].closed != 0:
        return size
    elif kind == CANCELLED:
        return _close(s, r, routes, lengths, index, GONE, hour, size)
    else:
        return _change(s, r, routes, lengths, k, hour, size)
    return size


@compiled_in_place
def _change(s: Situation, r: Schedule, routes: Ints, lengths: Ints, k: int, hour: float, size: int) -> int:
    """Open a task, or change its work left."""
    j = s.events[k].index
    _update(s, r, j, hour)
    if s.events[k].kind == OPENS:
        r.tasks[j].is_open = True
        r.tasks[j].left = s.tasks[j].left
        i = r.tasks[j].head
        while i >= 0:
            if r.agents[i].state == PRESENT:
                size = _join(s, r, i, j, hour, size)
            i = r.agents[i].following
    else:
        r.tasks[j].left = s.events[k].amount
    if r.tasks[j].left == 0:
        return _close(s, r, routes, lengths, j, DONE, hour, size)
    return _announce(s, r, j, hour, size)


@compiled_in_place
def _leave(s: Situation, r: Schedule, i: int, hour: float, size: int) -> int:
    """Remove an agent from the mission, for good or for a while."""
    j = r.agents[i].target
    if j >= 0 and r.tasks[j].closed != 0:  # in flight to a closed task
        r.agents[i].version += 1
    elif j >= 0:
        if r.tasks[j].head == i:
            r.tasks[j].head = r.agents[i].following
        else:
            before = r.tasks[j].head
            while r.agents[before].following != i:
                before = r.agents[before].following
            r.agents[before].following = r.agents[i].following
        if r.agents[i].state == FLYING:
            if not land(s, r, i, hour):
                r.agents[i].version += 1
        elif r.tasks[j].is_open:
            _update(s, r, j, hour)
            r.tasks[j].rate -= s.agents[i].ability * s.pace
            if r.tasks[j].rate < 1e-12:
                r.tasks[j].rate = 0.0
            size = _announce(s, r, j, hour, size)
    r.agents[i].target, r.agents[i].state = -1, AWAY
    return size
