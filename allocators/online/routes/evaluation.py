"""Incremental evaluation of plans: only agents that a change affects are scheduled anew."""

import numpy as np

from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.schedule import DONE, GONE, OVER, is_at_first, play_touched
from alloc.allocators.online.routes.situation import Ints, Situation
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.distances.reach import TOLERANCE


@compiled_in_place
def play(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> None:
    """Compute the whole schedule of a plan.

    Parameters
    ----------
    s : Situation
    r : Schedule
        Output, large enough for the plan.
    routes : ndarray of int, shape (n, c)
        Tasks of each agent, in order.
    lengths : ndarray of int, shape (n,)
    """
    for i in range(len(s.agents)):
        r.agents[i].touched = 1
    for j in range(len(s.tasks)):
        r.tasks[j].touched = 1
    _schedule(s, r, routes, lengths)


@compiled_in_place
def replay(s: Situation, r: Schedule, routes: Ints, lengths: Ints, before: Ints, before_lengths: Ints) -> None:
    """Update the schedule of a previous plan to that of a changed one.

    Parameters
    ----------
    s : Situation
    r : Schedule
        Schedule of the previous plan, except for agents and tasks already marked as touched.
    routes, before : ndarray of int, shape (n, c)
        Tasks of each agent, in order, in the new and the previous plan.
    lengths, before_lengths : ndarray of int, shape (n,)
    """
    for i in range(len(lengths)):
        if r.agents[i].touched or _differs(routes, lengths, before, before_lengths, i):
            r.agents[i].touched = 1
    grows = True
    while grows:
        grows = False
        for i in range(len(lengths)):
            if r.agents[i].touched == 1:
                r.agents[i].touched = 2
                grows = True
                for p in range(lengths[i]):
                    r.tasks[routes[i, p]].touched = 1
                for p in range(before_lengths[i]):
                    r.tasks[before[i, p]].touched = 1
        for i in range(len(lengths) if grows else 0):
            if not r.agents[i].touched and (_shares(r, routes, lengths, i) or _shares(r, before, before_lengths, i)):
                r.agents[i].touched = 1
    _schedule(s, r, routes, lengths)


@inlined
def _differs(routes: Ints, lengths: Ints, before: Ints, before_lengths: Ints, i: int) -> bool:
    if lengths[i] != before_lengths[i]:
        return True
    differs = False
    for p in range(lengths[i]):
        differs = differs or routes[i, p] != before[i, p]
    return differs


@inlined
def _shares(r: Schedule, routes: Ints, lengths: Ints, i: int) -> bool:
    shares = False
    for p in range(lengths[i]):
        shares = shares or r.tasks[routes[i, p]].touched != 0
    return shares


@compiled_in_place
def _schedule(s: Situation, r: Schedule, routes: Ints, lengths: Ints) -> None:
    """Schedule all touched agents: jointly, or one by one if no two of them share a task."""
    meets = len(s.events) > 0
    if not meets:
        for j in range(len(s.tasks)):
            r.tasks[j].visitors = 0
        for i in range(len(lengths)):
            if r.agents[i].touched:
                for p in range(lengths[i]):
                    r.tasks[routes[i, p]].visitors += 1
                    meets = meets or r.tasks[routes[i, p]].visitors > 1
    if meets:
        play_touched(s, r, routes, lengths)
    else:
        for j in range(len(s.tasks)):
            if r.tasks[j].touched:
                r.tasks[j].closed, r.tasks[j].finish = 0, np.inf
        for i in range(len(lengths)):
            if r.agents[i].touched:
                _play_alone(s, r, routes, lengths, i)
    _sum_up(s, r)


@compiled_in_place
def _play_alone(s: Situation, r: Schedule, routes: Ints, lengths: Ints, i: int) -> None:
    """Compute the schedule of an agent that shares no task with others."""
    hour, node, first, p = max(s.hour, s.agents[i].free), -1, -1, 0
    r.agents[i].fuel, r.agents[i].energy, r.agents[i].hours = s.agents[i].battery, 0.0, 0.0
    r.agents[i].works = 0.0
    for q in range(lengths[i]):
        r.arrive[i, q] = r.leave[i, q] = np.nan
    rate, speed, consumption = s.agents[i].ability * s.pace, s.agents[i].speed, s.agents[i].consumption
    while p < lengths[i] and s.agents[i].active:
        j = routes[i, p]
        arrives, way, limit = s.hour, 0.0, s.tasks[j].deadline
        if p > 0 or not is_at_first(s, routes, lengths, i):
            way = s.start_distance[i, j] if node < 0 else s.distance[node, j]
            arrives = hour + way / speed
            if (
                not s.allowed[i, j]
                or way > s.agents[i].reach + TOLERANCE
                or consumption * (way + s.home[j, i]) > r.agents[i].fuel + TOLERANCE
                or arrives >= limit
            ):
                p += 1
                continue
        first = j if first < 0 else first
        if arrives > s.end:
            break
        r.agents[i].fuel -= consumption * way
        r.agents[i].energy += consumption * way
        r.agents[i].hours += arrives - hour if way > 0 else 0.0
        r.arrive[i, p], node = arrives, j
        left = s.tasks[j].left + (0.0 if s.tasks[j].begun else s.tasks[j].growth * (arrives - s.hour))
        end = arrives + left / rate if rate > 0 else np.inf
        if min(end, limit) > s.end:
            break
        hour = min(end, limit)
        r.tasks[j].closed = DONE if end <= limit else OVER
        r.tasks[j].finish = end if end <= limit else np.inf
        r.leave[i, p] = hour
        r.agents[i].works += hour - arrives
        p += 1
    r.agents[i].first = first


@compiled_in_place
def _sum_up(s: Situation, r: Schedule) -> None:
    """Compute the totals of the schedule."""
    r.totals[:] = 0.0
    for j in range(len(s.tasks)):
        if r.tasks[j].closed == DONE:
            r.totals[1] = max(r.totals[1], r.tasks[j].finish)
            r.totals[2] += s.tasks[j].weight * (r.tasks[j].finish - s.tasks[j].appears)
        elif r.tasks[j].closed != GONE:
            r.totals[0] += s.tasks[j].weight
    for i in range(len(s.agents)):
        r.totals[3] += r.agents[i].energy
        r.totals[4] += r.agents[i].hours
        r.totals[5] += r.agents[i].works


@compiled_in_place
def copy_touched(
    marks: Schedule,
    r: Schedule,
    routes: Ints,
    lengths: Ints,
    other: Schedule,
    other_routes: Ints,
    other_lengths: Ints,
) -> None:
    """Copy the touched agents and tasks of a plan and its schedule onto another plan, and clear the marks.

    Parameters
    ----------
    marks : Schedule
        The one of the two that has the marks.
    r : Schedule
        Source.
    routes, lengths : ndarray of int
    other : Schedule
        Target.
    other_routes, other_lengths : ndarray of int
    """
    for i in range(len(lengths)):
        if marks.agents[i].touched:
            marks.agents[i].touched = 0
            other_lengths[i] = lengths[i]
            for p in range(lengths[i]):
                other_routes[i, p] = routes[i, p]
                other.arrive[i, p], other.leave[i, p] = r.arrive[i, p], r.leave[i, p]
            other.agents[i].first, other.agents[i].fuel = r.agents[i].first, r.agents[i].fuel
            other.agents[i].energy, other.agents[i].hours = r.agents[i].energy, r.agents[i].hours
            other.agents[i].works = r.agents[i].works
    for j in range(len(r.tasks)):
        if marks.tasks[j].touched:
            marks.tasks[j].touched = 0
            other.tasks[j].closed, other.tasks[j].finish = r.tasks[j].closed, r.tasks[j].finish
