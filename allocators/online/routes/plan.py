"""Route plans from the plan in force: set up, improved until the time limit, and read off."""

import math
import time
from collections.abc import Mapping, Sequence, Set

import numpy as np

from alloc.allocators.online.routes.describe import Described
from alloc.allocators.online.routes.evaluation import play
from alloc.allocators.online.routes.record import Schedule, new_schedule
from alloc.allocators.online.routes.search import WAYS, improve
from alloc.allocators.online.routes.situation import (
    AGENT,
    EUCLIDEAN,
    EVENT,
    TASK,
    Bools,
    Floats,
    Ints,
    Situation,
    records,
)

PORTION, PORTION_S = 8, 0.001
"""Number of changes before the clock is first checked, and target of the seconds between two checks."""

MAX_GROWTH, CAUTION = 4.0, 0.5
"""Largest growth factor of the batch of tasks inserted at once, and safety factor on the estimated batch size."""

CROWDED = 0.7
"""Where all work takes more than this share of the hours up to the last deadline, flights leave no time for all: a
limited time then goes to the tasks that take least time, and not to those that are due first."""

TOLERATED = 0.05
"""Relative amount by which an accepted plan may initially be worse than the best one; it decreases to 0."""


def improved(
    described: Described,
    before: Mapping[str, Sequence[str]],
    iterations: int,
    seed: int,
    until: float | None,
    given_up: Set[str] = frozenset(),
) -> tuple[Ints, Ints, Bools]:
    """Return improved routes, starting from those in force.

    With a time limit, new tasks are inserted in batches, no more than time allows: early deadlines first, and
    of others those near an agent. Without one, all at once, which yields better plans.

    Parameters
    ----------
    described : Described
    before : mapping of str to sequence of str
        Ids of each agent's tasks in the plan in force.
    iterations : int
        Number of changes to try.
    seed : int
    until : float or None
        Value of `time.perf_counter` at which to stop; None for no limit.
    given_up : set of str
        Tasks that could not be inserted before; only the search's own moves try them again.

    Returns
    -------
    routes, lengths, untried : ndarray
        Tasks of each agent, shape (n, c), the length of each route, shape (n,), and which tasks there was no time to
        insert, shape (m,).
    """
    situation = described.situation
    n, m = situation.start_distance.shape
    column = {task.facts.id: j for j, task in enumerate(described.tasks)}
    routes = np.zeros((n, min(m, 4 * (m // n) + 16)), np.int64)
    lengths = np.zeros(n, np.int64)
    for i, agent in enumerate(described.agents):
        kept = [column[name] for name in before.get(agent.facts.id, ()) if name in column][: routes.shape[1]]
        routes[i, : len(kept)] = kept
        lengths[i] = len(kept)
    pair = _new_schedules(situation, routes)
    fresh = np.array([task.facts.id not in given_up for task in described.tasks])
    fresh[[j for i in range(n) for j in routes[i, : lengths[i]].tolist()]] = False
    is_crowded = _is_crowded(situation)
    near, deadline = situation.start_distance.min(axis=0), situation.tasks["deadline"]
    waiting = np.argsort(near, kind="stable") if is_crowded else np.lexsort((near, deadline))
    waiting = waiting[fresh[waiting]]
    done, began = 0, time.perf_counter()
    portion, hour = iterations if until is None else PORTION, began
    size = len(waiting) if until is None else max(PORTION, n)
    ways = (0, WAYS) if until is None else (WAYS - 1, WAYS) if is_crowded else (0, 2)
    while len(waiting) or done < iterations:
        share = 0.0 if until is None else min(1.0, (hour - began) / max(1e-9, until - began))
        tolerated = TOLERATED * (1 - share), 0.0 if until is None else TOLERATED * (1 - share)
        fresh[:] = False
        fresh[waiting[:size]] = True
        is_last = len(waiting) <= size
        portion = min(portion, iterations - done) if is_last else 0
        plan, number = (routes, lengths), (seed + 7919 * (done + len(waiting[size:]))) % 2**31
        improve(situation, pair, described.nearest, plan, portion, number, fresh, ways, tolerated)
        waiting, done, last, hour = waiting[size:], done + portion, hour, time.perf_counter()
        if until is not None and hour >= until:
            break
        if until is not None and not is_last:
            size = _next_size(size, hour - last, until - hour)
            portion = PORTION
        else:
            portion *= 2 if hour - last < PORTION_S else 1
    fresh[:] = False
    fresh[waiting] = True
    return routes, lengths, fresh


def _is_crowded(situation: Situation) -> bool:
    """Return whether there is no time for all tasks that have deadlines."""
    deadline = situation.tasks["deadline"]
    is_due = np.isfinite(deadline)
    if not is_due.any():
        return True
    work = situation.tasks["left"][is_due].sum() / (situation.agents["ability"].sum() * situation.pace)
    return bool(work > CROWDED * (deadline[is_due].max() - situation.hour))


def _next_size(size: int, seconds: float, left: float) -> int:
    """Return the size of the next batch, given the seconds of the last one; the time grows with the size squared."""
    return max(1, int(size * min(MAX_GROWTH, CAUTION * math.sqrt(left / max(seconds, 1e-9)))))


def first_tasks(situation: Situation, routes: Ints, lengths: Ints) -> Ints:
    """Return the first task of each agent in the schedule, -1 for none."""
    schedule, _ = _new_schedules(situation, routes)
    play(situation, schedule, routes, lengths)
    return schedule.agents["first"]


def finish_hours(situation: Situation, routes: Ints, lengths: Ints) -> Floats:
    """Return the hour at which each task is done, ``inf`` if it is not."""
    schedule, _ = _new_schedules(situation, routes)
    play(situation, schedule, routes, lengths)
    return schedule.tasks["finish"]


def warm_up() -> None:
    """Compile the loops, or load them from the cache."""
    table, site = np.zeros((1, 1)), np.zeros((1, 3))
    agents = records(AGENT, 1, ability=1, speed=1, reach=1, battery=1, active=1, at=-1, aim=-1)
    tasks = records(TASK, 1, left=1, weight=1, deadline=9, is_open=1)
    allowed, events = np.ones((1, 1), np.bool_), records(EVENT, 0)
    situation = Situation(
        0.0, 9.0, agents, tasks, events, allowed, table, table, table, site, site, EUCLIDEAN, 1.0, False, 0.0, 1.0
    )
    plan = np.zeros((1, 1), np.int64), np.zeros(1, np.int64)
    pair = _new_schedules(situation, plan[0])
    improve(situation, pair, np.zeros((1, 1), np.int64), plan, 1, 0, np.ones(1, np.bool_), (0, 1), (0.0, 0.0))
    first_tasks(situation, *plan)


def _new_schedules(situation: Situation, routes: Ints) -> tuple[Schedule, Schedule]:
    n, m = situation.start_distance.shape
    size = n, m, routes.shape[1], len(situation.events)
    return new_schedule(*size), new_schedule(*size)
