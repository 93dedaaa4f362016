"""What a repartition assigns anew: a few tasks between which agents can change, and some of their agents; compiled."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.allocators.runtime.random import RandomState, draw
from alloc.problems.instance import FloatArray, IntArray

Members = NDArray[np.int32]
"""Agents of each task, shape (t, n), as many as the task has."""

MAX_TASKS = 4
"""Tasks whose agents are assigned anew together, at the most."""

MAX_POOL = 12
"""Agents assigned anew together, at the most; of larger pools some stay where they are."""

RANDOM_STEPS = 1_000_000_000
"""Steps of a random number from 0 to 1."""


class Partners(NamedTuple):
    """Which tasks are drawn together, and which agents can change between them.

    Attributes
    ----------
    up_to : ndarray, shape (t, t)
        Probability that the partner drawn for the task of the row is one of the first columns; the last entry is 1, or
        0 where the task has no partner.
    use : ndarray of int8, shape (n, t)
        0 where the agent is of no use to the task, 1 where it is of some, 2 where it is of good use.
    """

    up_to: FloatArray
    use: NDArray[np.int8]


@compiled
def shortfall(has: float, need: float) -> float:
    """How much a task has less than it needs; 0 within rounding errors."""
    return max(0.0, need - has) if has < need * (1 - 1e-12) else 0.0


@compiled
def draw_partner(up_to: FloatArray, state: RandomState) -> int:
    """Draw a column by its row of `Partners.up_to`."""
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
    """Draw a task with a shortfall, and partners of those drawn: write them to `task` and return how many they are."""
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
    """Collect the agents of the tasks, those to be assigned anew first.

    Writes the agents to `pool`, and which of the tasks each is on to `at`; returns how many there are in all, and how
    many are to be assigned anew: some of those that are of good use to another of the tasks, now and then of any use.
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
