"""Matchings for more tasks than agents, first by a sample of the pairs, then by augmenting paths."""

from collections import deque

import numpy as np

from alloc.problems.instance import Instance, IntArray
from alloc.problems.matching.assignment import Pairs
from alloc.problems.matching.clock import Clock, share_of, unlimited
from alloc.problems.matching.hopcroft_karp import largest_matching
from alloc.problems.matching.pairs import bound_by_size, sampled_pairs
from alloc.problems.vocabulary import IDLE

SAMPLE_SHARE, LONGEST_S = 0.2, 2.0
"""Share of the time for the sample, and its limit in seconds."""

SHORTEST_S = 0.1
"""Minimum time in seconds, even without time left."""

SLOWER = (4.0, 16.0, np.inf)
"""Makespans to try in turn, as multiples of a bound."""


class AgentMatching:
    """A matching of agents with `tasks`, as large as time allows, which serves all tasks that `start` serves.

    Attributes
    ----------
    task_of_agent : ndarray of int, shape (n,)
        Task of each agent, without repetitions; `IDLE` for none.
    is_largest : bool
        Whether the matching is maximum.
    replaceable : ndarray of bool, shape (n,)
        Agents that some maximum matching leaves idle; complete if `is_largest`.
    their_tasks : ndarray of bool, shape (m,)
        Tasks within reach of these agents; every maximum matching serves them by these agents.
    """

    def __init__(self, instance: Instance, tasks: IntArray, time_left: Clock, start: IntArray | None = None) -> None:
        self._reach = instance.reach
        self._wanted = np.zeros(instance.m, dtype=np.bool_)
        self._wanted[tasks] = True
        self.task_of_agent = _of_sample(instance, tasks, time_left) if start is None else start.copy()
        self.replaceable = np.zeros(instance.n, dtype=np.bool_)
        self.their_tasks = np.zeros(instance.m, dtype=np.bool_)
        self._holder = np.full(instance.m, IDLE, dtype=np.intp)
        held = np.flatnonzero(self.task_of_agent != IDLE)
        self._holder[self.task_of_agent[held]] = held
        self.is_largest = all(
            self._augment(agent, time_left) for agent in np.flatnonzero(self.task_of_agent == IDLE).tolist()
        )

    def _augment(self, agent: int, time_left: Clock) -> bool:
        """Augment `agent` along a shortest path, or mark all agents reached; return False if time runs out."""
        queue, agents = deque([agent]), [agent]
        seen = self.their_tasks.copy()
        wanted_by: dict[int, int] = {}
        while queue:
            if time_left() <= 0:
                return False
            able = queue.popleft()
            mask = self._reach.rows(self._reach.origin[able : able + 1])[1][0]
            tasks = np.flatnonzero(mask & self._wanted & ~seen)
            free = tasks[self._holder[tasks] == IDLE]
            if len(free):
                self._move(able, int(free[0]), wanted_by)
                return True
            seen[tasks] = True
            wanted_by.update(dict.fromkeys(tasks.tolist(), able))
            holders = self._holder[tasks].tolist()
            queue.extend(holders)
            agents.extend(holders)
        self.replaceable[agents] = True
        self.their_tasks = seen
        return True

    def _move(self, agent: int, task: int, wanted_by: dict[int, int]) -> None:
        while True:
            before = int(self.task_of_agent[agent])
            self.task_of_agent[agent], self._holder[task] = task, agent
            if before == IDLE:
                return
            task, agent = before, wanted_by[before]


def _of_sample(instance: Instance, tasks: IntArray, time_left: Clock) -> IntArray:
    """Return a large matching from a sample of the pairs."""
    everyone = np.arange(instance.n)
    seconds = max(SHORTEST_S, min(LONGEST_S, SAMPLE_SHARE * time_left()))
    pairs, _ = sampled_pairs(instance, everyone, tasks, None, seconds, unlimited)
    return _fast_matching(pairs, bound_by_size(instance, everyone, tasks), time_left)


def _fast_matching(pairs: Pairs, bound: float, time_left: Clock) -> IntArray:
    """Return a large matching, preferring fast pairs."""
    matched = np.full(len(pairs.first) - 1, IDLE, dtype=np.intp)
    time_left = share_of(0.5, time_left)
    for factor in SLOWER:
        within = pairs.within(factor * bound)
        matched, _ = largest_matching(within.first, within.task, matched, time_left)
        if (matched != IDLE).all():
            break
    return matched
