"""Plans of routes from plans in force: set up, improved until the time is up, read."""

import time
from collections.abc import Mapping, Sequence

import numpy as np

from alloc.allocators.online.routes.describe import Described
from alloc.allocators.online.routes.record import new_schedule
from alloc.allocators.online.routes.schedule import play
from alloc.allocators.online.routes.search import improve
from alloc.allocators.online.routes.situation import AGENT, EUCLIDEAN, EVENT, TASK, Ints, Situation, records

PORTION = 25
"""Changes between two looks at the clock."""


def improved(
    described: Described, before: Mapping[str, Sequence[str]], iterations: int, seed: int, until: float | None
) -> tuple[Ints, Ints]:
    """Return routes that begin with those in force.

    Parameters
    ----------
    described : Described
    before : mapping of str to sequence of str
        Tasks of each agent in the plan in force, by their ids.
    iterations : int
        Changes to be tried.
    seed : int
    until : float or None
        Second of `time.perf_counter` at which to stop; None for no limit.

    Returns
    -------
    tuple of ndarray
        Tasks of each agent, shape (n, c), and how many there are, shape (n,).
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
    schedule = new_schedule(n, m, routes.shape[1], len(situation.events))
    planned = {j for i in range(n) for j in routes[i, : lengths[i]].tolist()}
    is_new, done = len(planned) < m, 0
    while is_new or done < iterations:
        portion = iterations if until is None else min(PORTION, iterations - done)
        improve(situation, schedule, described.nearest, routes, lengths, portion, (seed + 7919 * done) % 2**31, is_new)
        is_new, done = False, done + portion
        if until is not None and time.perf_counter() >= until:
            break
    return routes, lengths


def first_tasks(situation: Situation, routes: Ints, lengths: Ints) -> Ints:
    """Return the task to which each agent goes first, -1 for none."""
    schedule = new_schedule(*situation.start_distance.shape, routes.shape[1], len(situation.events))
    play(situation, schedule, routes, lengths)
    return schedule.agents["first"]


def warm_up() -> None:
    """Compile the loops, or read them from their cache."""
    table, site = np.zeros((1, 1)), np.zeros((1, 3))
    agents = records(AGENT, 1, ability=1, speed=1, reach=1, battery=1, active=1, at=-1, aim=-1)
    tasks = records(TASK, 1, left=1, weight=1, deadline=9, is_open=1)
    allowed, events = np.ones((1, 1), np.bool_), records(EVENT, 0)
    situation = Situation(
        0.0, 9.0, agents, tasks, events, allowed, table, table, table, site, site, EUCLIDEAN, 1.0, False, 0.0, 1.0
    )
    routes, lengths = np.zeros((1, 1), np.int64), np.zeros(1, np.int64)
    improve(situation, new_schedule(1, 1, 1, 0), np.zeros((1, 1), np.int64), routes, lengths, 1, 0, True)
    first_tasks(situation, routes, lengths)
