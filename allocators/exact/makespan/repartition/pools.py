"""Selection of the tasks and agents of a repartition, compiled."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.instance import FloatArray, IntArray

Members = NDArray[np.int32]
"""Agents of each task, shape (t, n), valid up to the number of its agents."""

MAX_TASKS = 4
"""Largest number of tasks in a repartition."""

MAX_POOL = 12
"""Largest number of agents reassigned together; of larger pools, some agents stay where they are."""

RANDOM_STEPS = 1_000_000_000
"""Resolution of random numbers from 0 to 1."""


class Partners(NamedTuple):
    """Which tasks are drawn together, and which agents can change between them.

    Attributes
    ----------
    up_to : ndarray, shape (t, t)
        Cumulative probabilities of the partners of each row's task; the last entry is 1, or 0 if it has no partner.
    use : ndarray of int8, shape (n, t)
        Use of each agent to each task: 0 for none, 1 for some, 2 for good use.
    """

    up_to: FloatArray
    use: NDArray[np.int8]


@compiled
def shortfall(has: float, need: float) -> float:
    """Return the shortfall of a task, 0 within rounding errors."""
    return max(0.0, need - has) if has < need * (1 - 1e-12) else 0.0


@compiled
def draw_partner(up_to: FloatArray, state: RandomState) -> int:
    """Draw a column from a row of `Partners.up_to`."""
    value = draw(state, RANDOM_STEPS) / RANDOM_STEPS
    low, high = 0, len(up_to) - 1
    while low < high:
        middle = (low + high) // 2
        if up_to[middle] > value:
            high = middle
        else:
            low = middle + 1
    return low


@compiled
def draw_tasks(has: FloatArray, need: FloatArray, partners: Partners, state: RandomState, task: IntArray) -> int:
    """Draw a task with a shortfall, then partners of those drawn; write them to `task` and return their number."""
    count, t = 0, len(need)
    for j in range(t):
        if shortfall(has[j], need[j]) > 0:
            count += 1
            if draw(state, count) == 0:
                task[0] = j
    wanted = min(t, 2 + (draw(state, 8) > 0) + (draw(state, 4) == 0))
    tasks = 1
    for _ in range(3 * (wanted - 1)):
        row = partners.up_to[task[draw(state, tasks)]]
        if row[t - 1] == 0.0:
            continue
        task[tasks] = draw_partner(row, state)
        new = True
        for q in range(tasks):
            new &= task[q] != task[tasks]
        tasks += new
        if tasks == wanted:
            break
    return tasks


@compiled
def draw_pool(
    task: IntArray,
    tasks: int,
    size: IntArray,
    members: Members,
    partners: Partners,
    state: RandomState,
    pool: IntArray,
    at: IntArray,
) -> tuple[int, int]:
    """Collect the agents of the tasks, those to be reassigned first.

    Write the agents to `pool` and the present task of each to `at`; return their number, and the number of those to be
    reassigned: some of those of good use, or occasionally of any use, to another of the tasks.
    """
    agents, movable = 0, 0
    least = 1 if draw(state, 4) == 0 else 2
    for q in range(tasks):
        j = task[q]
        for r in range(size[j]):
            i, moves = members[j, r], False
            for other in range(tasks):
                moves |= other != q and partners.use[i, task[other]] >= least
            pool[agents], at[agents] = i, q
            if moves:
                pool[agents], pool[movable] = pool[movable], i
                at[agents], at[movable] = at[movable], q
                movable += 1
            agents += 1
    used = min(movable, MAX_POOL)
    for p in range(used):
        r = p + draw(state, movable - p)
        pool[p], pool[r] = pool[r], pool[p]
        at[p], at[r] = at[r], at[p]
    return agents, used
