"""Repartition: optimal reassignment of the agents of two to four tasks among these tasks, compiled.

With two to four agents per task, single moves and swaps soon stall, while a few tasks together have so few agents that
all partitions can be enumerated. One of the tasks has a shortfall; the others are drawn among those to which agents can
easily change. Ties between best partitions are broken at random, so that the search drifts over plateaus.
"""

import numpy as np

from alloc.allocators.exact.makespan.repartition.pools import (
    MAX_POOL,
    MAX_TASKS,
    Members,
    Partners,
    draw_pool,
    draw_tasks,
    shortfall,
)
from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.instance import FloatArray, IntArray


@compiled
def sum_subsets(value: FloatArray, size: int, sums: FloatArray) -> None:
    """Write the sum of each subset of the first `size` values, indexed by bit mask."""
    sums[0] = 0.0
    for bit in range(size):
        for mask in range(1 << bit):
            sums[(1 << bit) + mask] = sums[mask] + value[bit]


@compiled
def prepare_sums(
    value: FloatArray, base: FloatArray, need: FloatArray, tasks: int, size: int, sums: FloatArray
) -> tuple[float, FloatArray]:
    """Fill `sums` for `best_partition`: the contribution of each subset of agents to each task, and its maximum.

    Returns
    -------
    float
        Difference up to which two shortfalls count as equal.
    ndarray, shape (MAX_TASKS,)
        Total need from the pool of the tasks after each one.
    """
    slack, largest = 0.0, np.zeros(size)
    for task in range(tasks):
        slack = max(slack, 1e-9 * need[task])
        sum_subsets(value[task], size, sums[task])
        for agent in range(size):
            largest[agent] = max(largest[agent], value[task, agent])
    sum_subsets(largest, size, sums[MAX_TASKS])
    later = np.zeros(MAX_TASKS)
    for task in range(tasks - 2, -1, -1):
        later[task] = later[task + 1] + need[task + 1] - base[task + 1]
    return slack, later


@compiled
def best_partition(
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
    """Assign agents to two to four tasks with the least total shortfall; return it, or ``inf`` if it exceeds `within`.

    Parameters
    ----------
    value : ndarray, shape (MAX_TASKS, MAX_POOL)
        Contribution of each of `size` agents to each of `tasks` tasks.
    base, need : ndarray, shape (MAX_TASKS,)
        Work that each task has from agents outside the pool, and its need.
    sums : ndarray, shape (MAX_TASKS + 1, 2**MAX_POOL)
        Scratch.
    chosen : ndarray of int, shape (MAX_TASKS,)
        Output: the agents of each task as bit masks, with random ties; unchanged if there is no such partition.
    """
    all_agents = (1 << size) - 1
    slack, later = prepare_sums(value, base, need, tasks, size, sums)
    best, equals, found = within, 0, False
    for first in range(all_agents + 1):
        short = shortfall(base[0] + sums[0, first], need[0])
        rest = all_agents ^ first
        if short + max(0.0, later[0] - sums[MAX_TASKS, rest]) > best + slack:
            continue
        second = rest
        while True:
            short2 = short + shortfall(base[1] + sums[1, second], need[1])
            rest2 = rest ^ second
            if tasks == 2:
                third, deep = 0, short2 <= best + slack
            else:
                third, deep = rest2, short2 + max(0.0, later[1] - sums[MAX_TASKS, rest2]) <= best + slack
            while deep:
                total = short2
                if tasks > 2:
                    total += shortfall(base[2] + sums[2, third], need[2])
                if tasks > 3:
                    total += shortfall(base[3] + sums[3, rest2 ^ third], need[3])
                if total <= best + slack:
                    equals = 1 if not found or total < best - slack else equals + 1
                    if equals == 1 or draw(state, equals) == 0:
                        best, found = total, True
                        chosen[0], chosen[1], chosen[2], chosen[3] = first, second, third, rest2 ^ third
                if tasks < 4 or third == 0:
                    break
                third = (third - 1) & rest2
            if tasks == 2 or second == 0:
                break
            second = (second - 1) & rest
    return best if found else np.inf


@compiled
def count_agents(work: FloatArray, place: IntArray, has: FloatArray, size: IntArray, members: Members) -> None:
    """Fill `has`, `size` and `members`, the work, number and list of agents of each task, from `place`."""
    for i in range(len(place)):
        j = place[i]
        has[j] += work[i, j]
        members[j, size[j]] = i
        size[j] += 1


@compiled
def total_shortfall(has: FloatArray, need: FloatArray) -> tuple[float, float]:
    """Return the total shortfall, and the smallest share of its need that a task has."""
    total, least = 0.0, np.inf
    for j in range(len(need)):
        total += shortfall(has[j], need[j])
        least = min(least, has[j] / need[j])
    return total, least


@compiled
def reassign(
    work: FloatArray,
    task: IntArray,
    tasks: int,
    chosen: IntArray,
    pool: IntArray,
    at: IntArray,
    agents: int,
    used: int,
    place: IntArray,
    has: FloatArray,
    size: IntArray,
    members: Members,
) -> None:
    """Move the first `used` agents of the pool to the tasks given by `chosen`, and update all dependent arrays."""
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


@compiled
def search_repartitions(
    work: FloatArray,
    need: FloatArray,
    partners: Partners,
    place: IntArray,
    steps: int,
    state: RandomState,
) -> tuple[float, float, IntArray]:
    """Repartition the agents of a few tasks, `steps` times or until all needs are met.

    Parameters
    ----------
    work : ndarray, shape (n, t)
        Contribution of each agent to each task, 0 out of reach.
    need : ndarray, shape (t,)
        Need of each task, > 0.
    partners : Partners
        Which tasks are drawn together, and which agents are reassigned.
    place : ndarray of int, shape (n,)
        Task of each agent, none idle; changed in place.
    steps : int
    state : ndarray of uint64, shape (1,)

    Returns
    -------
    float
        Final total shortfall.
    float
        Best value over the search of the smallest share of its need that a task has.
    ndarray of int, shape (n,)
        Task of each agent at that value.
    """
    n, t = work.shape
    has, size, members = np.zeros(t), np.zeros(t, dtype=np.int64), np.empty((t, n), dtype=np.int32)
    count_agents(work, place, has, size, members)
    sums = np.empty((MAX_TASKS + 1, 1 << MAX_POOL))
    task, chosen = np.empty(MAX_TASKS, dtype=np.int64), np.zeros(MAX_TASKS, dtype=np.int64)
    value, base, needs = np.empty((MAX_TASKS, MAX_POOL)), np.empty(MAX_TASKS), np.empty(MAX_TASKS)
    pool, at = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    best = place.copy()
    total, least = total_shortfall(has, need)
    for _ in range(steps):
        if total == 0.0:
            break
        tasks = draw_tasks(has, need, partners, state, task)
        if tasks < 2:
            break
        agents, used = draw_pool(task, tasks, size, members, partners, state, pool, at)
        before = 0.0
        for q in range(tasks):
            base[q], needs[q] = has[task[q]], need[task[q]]
            before += shortfall(base[q], needs[q])
        for p in range(used):
            for q in range(tasks):
                value[q, p] = work[pool[p], task[q]]
            base[at[p]] -= value[at[p], p]
        if best_partition(value, base, needs, tasks, used, before, sums, state, chosen) == np.inf:
            continue
        reassign(work, task, tasks, chosen, pool, at, agents, used, place, has, size, members)
        total, lowest = total_shortfall(has, need)
        if lowest > least:
            least = lowest
            for i in range(n):
                best[i] = place[i]
    return total, least, best
