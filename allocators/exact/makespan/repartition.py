"""A plan for a given T by splitting the agents of two, three or four tasks anew, in the best way there is; compiled.

With two to four agents per task, single moves and swaps soon find nothing, while a few tasks have so few agents between
them that all ways of splitting these can be tried. That is done over and over for a task that is short and others drawn
at random; of several best splits one is drawn, so that the search wanders where nothing gets better.
"""

import numpy as np

from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.instance import FloatArray, IntArray

MOST_TASKS = 4
"""Tasks whose agents are split together at the most."""

POOL = 12
"""Agents that are split together at the most; of larger pools some stay where they are."""


@compiled
def sum_subsets(value: FloatArray, size: int, sums: FloatArray) -> None:
    """Write the sum of each subset of the first `size` values, numbered by its bits."""
    sums[0] = 0.0
    for bit in range(size):
        for mask in range(1 << bit):
            sums[(1 << bit) + mask] = sums[mask] + value[bit]


@compiled
def missing(has: float, need: float) -> float:
    """What a task lacks; rounding errors are none."""
    return max(0.0, need - has) if has < need * (1 - 1e-12) else 0.0


@compiled
def split(
    value: FloatArray,
    base: FloatArray,
    need: FloatArray,
    tasks: int,
    size: int,
    within: float,
    sums: FloatArray,
    state: RandomState,
    chosen: IntArray,
) -> float:
    """Split agents over two to four tasks such that as little as possible is missing; return that.

    Parameters
    ----------
    value : ndarray, shape (MOST_TASKS, POOL)
        What each agent adds to each task.
    base, need : ndarray, shape (MOST_TASKS,)
        What each task has already, and needs.
    tasks : int
        How many they are.
    size : int
        Agents to split.
    within : float
        Only splits that miss at most this are looked for.
    sums : ndarray, shape (MOST_TASKS + 1, 2**POOL)
        Space to work in.
    state : ndarray of uint64, shape (1,)
        Of the random numbers.
    chosen : ndarray of int, shape (MOST_TASKS,)
        Gets the agents of each task, as bits; of several best splits a random one. Unchanged if there is none.

    Returns
    -------
    float
        ``inf`` if there is no such split.
    """
    all_agents, most, slack = (1 << size) - 1, sums[MOST_TASKS], 0.0
    largest = np.zeros(size)
    for task in range(tasks):
        slack = max(slack, 1e-9 * need[task])
        sum_subsets(value[task], size, sums[task])
        for agent in range(size):
            largest[agent] = max(largest[agent], value[task, agent])
    sum_subsets(largest, size, most)
    later = np.zeros(MOST_TASKS)  # what the tasks after each one need from the pool
    for task in range(tasks - 2, -1, -1):
        later[task] = later[task + 1] + need[task + 1] - base[task + 1]
    best, equals, found = within, 0, False
    for first in range(all_agents + 1):
        lacks = missing(base[0] + sums[0, first], need[0])
        rest = all_agents ^ first
        if lacks + max(0.0, later[0] - most[rest]) > best + slack:
            continue
        second = rest
        while True:
            lacks2 = lacks + missing(base[1] + sums[1, second], need[1])
            rest2 = rest ^ second
            if tasks == 2:
                third, deep = 0, lacks2 <= best + slack
            else:
                third, deep = rest2, lacks2 + max(0.0, later[1] - most[rest2]) <= best + slack
            while deep:
                total, fourth = lacks2, 0
                if tasks > 2:
                    total += missing(base[2] + sums[2, third], need[2])
                if tasks > 3:
                    fourth = rest2 ^ third
                    total += missing(base[3] + sums[3, fourth], need[3])
                if total <= best + slack:
                    equals = 1 if not found or total < best - slack else equals + 1
                    if equals == 1 or draw(state, equals) == 0:
                        best, found = total, True
                        chosen[0], chosen[1] = first, second
                        if tasks > 2:
                            chosen[2] = third
                        if tasks > 3:
                            chosen[3] = fourth
                if tasks < 4 or third == 0:
                    break
                third = (third - 1) & rest2
            if tasks == 2 or second == 0:
                break
            second = (second - 1) & rest
    return best if found else np.inf


@compiled
def wander(
    work: FloatArray, need: FloatArray, place: IntArray, steps: int, state: RandomState
) -> tuple[float, float, IntArray]:
    """Split the agents of a few tasks anew, `steps` times or until every task has what it needs.

    Parameters
    ----------
    work : ndarray, shape (n, t)
        What each agent adds to each task, 0 where it cannot go.
    need : ndarray, shape (t,)
        What each task needs, > 0.
    place : ndarray of int, shape (n,)
        Task of each agent, no one idle; changed in place.
    steps : int
    state : ndarray of uint64, shape (1,)

    Returns
    -------
    float
        What is missing in the end, summed over tasks.
    float
        The largest part of its need that the shortest task had.
    ndarray of int, shape (n,)
        The places at that time.
    """
    n, t = work.shape
    has, size, members = np.zeros(t), np.zeros(t, dtype=np.int64), np.empty((t, n), dtype=np.int32)
    for i in range(n):
        j = place[i]
        has[j] += work[i, j]
        members[j, size[j]] = i
        size[j] += 1
    sums = np.empty((MOST_TASKS + 1, 1 << POOL))
    task, chosen = np.empty(MOST_TASKS, dtype=np.int64), np.zeros(MOST_TASKS, dtype=np.int64)
    value, base, needs = np.empty((MOST_TASKS, POOL)), np.empty(MOST_TASKS), np.empty(MOST_TASKS)
    pool, at = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    best = np.empty_like(place)
    for i in range(n):
        best[i] = place[i]
    total, least = 0.0, np.inf
    for j in range(t):
        total += missing(has[j], need[j])
        least = min(least, has[j] / need[j])
    for _ in range(steps):
        if total == 0.0:
            break
        count = 0
        for j in range(t):
            if missing(has[j], need[j]) > 0:
                count += 1
                if draw(state, count) == 0:
                    task[0] = j
        tasks = min(t, 2 + (draw(state, 8) > 0) + (draw(state, 4) == 0))
        if tasks < 2:
            break
        q = 1
        while q < tasks:
            task[q] = draw(state, t)
            new = True
            for r in range(q):
                new &= task[r] != task[q]
            if new:
                q += 1
        agents = 0
        before = 0.0
        for q in range(tasks):
            j = task[q]
            base[q], needs[q] = has[j], need[j]
            before += missing(has[j], need[j])
            for r in range(size[j]):
                pool[agents], at[agents] = members[j, r], q
                agents += 1
        used = min(agents, POOL)
        for p in range(used):
            r = p + draw(state, agents - p)
            pool[p], pool[r] = pool[r], pool[p]
            at[p], at[r] = at[r], at[p]
        for p in range(used):
            for q in range(tasks):
                value[q, p] = work[pool[p], task[q]]
            base[at[p]] -= value[at[p], p]
        after = split(value, base, needs, tasks, used, before, sums, state, chosen)
        if after == np.inf:
            continue
        for q in range(tasks):
            size[task[q]] = 0
        for p in range(agents):
            q = at[p]
            if p < used:
                for r in range(tasks):
                    if chosen[r] >> p & 1:
                        q = r
            j = task[q]
            place[pool[p]] = j
            members[j, size[j]] = pool[p]
            size[j] += 1
        for q in range(tasks):
            j = task[q]
            has[j] = 0.0
            for r in range(size[j]):
                has[j] += work[members[j, r], j]
        total = 0.0
        lowest = np.inf
        for j in range(t):
            total += missing(has[j], need[j])
            lowest = min(lowest, has[j] / need[j])
        if lowest > least:
            least = lowest
            for i in range(n):
                best[i] = place[i]
    return total, least, best
