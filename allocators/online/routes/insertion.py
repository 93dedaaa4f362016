"""Best insertion of a task into routes: for one agent, or for a coalition where one agent is too slow."""

# ruff: noqa: NPY002 - compiled code seeds numba's own generator

from typing import NamedTuple

import numpy as np

from alloc.allocators.online.routes.record import Schedule
from alloc.allocators.online.routes.situation import Floats, Ints, Situation
from alloc.allocators.runtime.compiled import compiled, compiled_in_place, inlined


@compiled_in_place
def tidy(r: Schedule, routes: Ints, lengths: Ints) -> bool:
    """Remove visits that the schedule skips; return whether there were any."""
    is_changed = False
    for i in range(len(lengths)):
        kept = 0
        for p in range(lengths[i]):
            if not np.isnan(r.arrive[i, p]):
                routes[i, kept], r.arrive[i, kept] = routes[i, p], r.arrive[i, p]
                r.leave[i, kept] = r.leave[i, p]
                kept += 1
        is_changed = is_changed or kept < lengths[i]
        lengths[i] = kept
    return is_changed


@compiled_in_place
def find_slack(s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int) -> None:
    """Compute by how many hours each visit of an agent may be delayed without missing a deadline."""
    least = np.inf
    for p in range(lengths[i] - 1, -1, -1):
        leave = r.leave[i, p]
        if np.isnan(leave):
            leave = r.arrive[i, p]
        least = min(least, min(s.tasks[routes[i, p]].deadline, s.end) - leave)
        slack[i, p] = least


@inlined
def hours_of_work(s: Situation, j: int, arrives: float, ability: float) -> float:
    """Return the hours that one agent needs for a task that it begins at hour `arrives`."""
    left = s.tasks[j].left
    if s.tasks[j].growth > 0 and not s.tasks[j].begun:
        left += s.tasks[j].growth * (arrives - max(s.hour, s.tasks[j].appears))
    return float(left / (ability * s.pace))


@inlined
def is_hopeless(s: Situation, r: Schedule, lengths: Ints, slack: Floats, i: int, p: int, hours: float) -> bool:
    """Return whether `hours` of work cannot fit before visit `p` of an agent, even without a detour."""
    begins = max(s.hour, s.agents[i].free) if p == 0 else r.leave[i, p - 1]
    return bool(p < lengths[i] and r.arrive[i, p] + slack[i, p] - begins < hours)


@inlined
def place_between(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, p: int, j: int
) -> tuple[float, float, float]:
    """Return the arrival, the latest departure and the added distance if a task is inserted as visit `p`.

    The arrival is ``inf`` if the insertion is infeasible.
    """
    if p == 0:
        begins, there, before = max(s.hour, s.agents[i].free), s.start_distance[i, j], -1
    else:
        before = routes[i, p - 1]
        begins, there = r.leave[i, p - 1], s.distance[before, j]
        if np.isnan(begins):
            return np.inf, 0.0, 0.0
    detour, latest = there, s.end
    if p < lengths[i]:
        after = routes[i, p]
        direct = s.start_distance[i, after] if before < 0 else s.distance[before, after]
        detour += s.distance[j, after] - direct
        latest = r.arrive[i, p] + slack[i, p] - s.distance[j, after] / s.agents[i].speed
    energy = s.agents[i].consumption * detour
    if there > s.agents[i].reach or (energy > 0 and energy > r.agents[i].fuel):
        return np.inf, 0.0, 0.0
    arrives = max(begins + there / s.agents[i].speed, s.tasks[j].appears if not s.tasks[j].is_open else s.hour)
    return arrives, latest, detour


@compiled_in_place
def insert(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, i: int, p: int, j: int, leaves: float
) -> None:
    """Insert a task into a route, left at hour `leaves`, and delay the later visits."""
    arrives, _, detour = place_between(s, r, routes, lengths, slack, i, p, j)
    r.agents[i].fuel -= s.agents[i].consumption * detour
    delay = 0.0
    if p < lengths[i]:
        delay = max(0.0, leaves + s.distance[j, routes[i, p]] / s.agents[i].speed - r.arrive[i, p])
    for q in range(lengths[i], p, -1):
        routes[i, q] = routes[i, q - 1]
        r.arrive[i, q], r.leave[i, q] = r.arrive[i, q - 1] + delay, r.leave[i, q - 1] + delay
    routes[i, p], r.arrive[i, p], r.leave[i, p] = j, arrives, leaves
    lengths[i] += 1
    find_slack(s, r, routes, lengths, slack, i)


@compiled_in_place
def insert_best(
    s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, j: int, balance: float, blink: float
) -> bool:
    """Insert a task at the position of least cost over all routes.

    Parameters
    ----------
    balance : float
        Weight of the end of the route relative to the time that the task adds to it.
    blink : float
        Probability of skipping a position.

    Returns
    -------
    bool
        Whether the task was inserted.
    """
    best, best_i, best_p, best_leaves = np.inf, -1, -1, 0.0
    for i in range(len(lengths)):
        count = lengths[i]
        if not s.allowed[i, j] or count >= routes.shape[1]:
            continue
        end = max(s.hour, s.agents[i].free) if count == 0 else r.leave[i, count - 1]
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
            lost = hours + detour / s.agents[i].speed
            cost = lost + balance * (max(end, leaves) if p == count else end + lost)
            if cost < best and np.random.random() >= blink:
                best, best_i, best_p, best_leaves = cost, i, p, leaves
    if best_i >= 0:
        insert(s, r, routes, lengths, slack, best_i, best_p, j, best_leaves)
        return True
    return False


@compiled
def insert_coalition(s: Situation, r: Schedule, routes: Ints, lengths: Ints, slack: Floats, j: int) -> bool:
    """Insert a task into the routes of the fewest agents that can do it in time, those with most work to offer first.

    Return whether there are enough agents.
    """
    n = len(lengths)
    windows = Windows(np.zeros(n), np.zeros(n, np.int64), np.zeros(n), np.zeros(n))
    _find_windows(s, r, routes, lengths, slack, j, windows)
    return _insert_fewest(s, r, routes, lengths, slack, j, windows, np.argsort(-windows.work))


class Windows(NamedTuple):
    """The position in each route that leaves most time for a task, shape (n,).

    Attributes
    ----------
    work : ndarray
        Work that the agent can do there, 0 for none.
    place : ndarray of int
        Position in the route.
    arrival, limit : ndarray
        Hours of arrival and of the latest departure.
    """

    work: Floats
    place: Ints
    arrival: Floats
    limit: Floats


@compiled_in_place
def _find_windows(
    s: Situation,
    r: Schedule,
    routes: Ints,
    lengths: Ints,
    slack: Floats,
    j: int,
    windows: Windows,
) -> None:
    """Find the windows of a task."""
    work, place, arrival, limit = windows
    for i in range(len(lengths)):
        if not s.allowed[i, j] or lengths[i] >= routes.shape[1]:
            continue
        for p in range(lengths[i] + 1):
            if is_hopeless(s, r, lengths, slack, i, p, work[i] / s.agents[i].ability):
                continue
            arrives, latest, _ = place_between(s, r, routes, lengths, slack, i, p, j)
            if arrives >= s.tasks[j].deadline:
                if arrives < np.inf:
                    break
                continue
            until = min(latest, s.tasks[j].deadline)
            if (until - arrives) * s.agents[i].ability > work[i]:
                work[i] = (until - arrives) * s.agents[i].ability
                place[i], arrival[i], limit[i] = p, arrives, until


@compiled_in_place
def _insert_fewest(
    s: Situation,
    r: Schedule,
    routes: Ints,
    lengths: Ints,
    slack: Floats,
    j: int,
    windows: Windows,
    order: Ints,
) -> bool:
    """Insert a task into the routes of the first agents in `order` that suffice; return whether there are enough."""
    work, place, arrival, limit = windows
    ability, late, until, first = 0.0, 0.0, np.inf, np.inf
    for k in range(len(order)):
        i = order[k]
        if work[i] <= 0:
            return False
        ability += s.agents[i].ability
        late += s.agents[i].ability * arrival[i]
        until, first = min(until, limit[i]), min(first, arrival[i])
        end = (hours_of_work(s, j, first, 1.0) + late) / ability
        if end <= until:
            for q in range(k + 1):
                member = order[q]
                if arrival[member] < end:
                    insert(s, r, routes, lengths, slack, member, place[member], j, end)
            return True
    return False
