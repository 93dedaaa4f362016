"""The plan of a search, its workspace and its weights, as arrays that compiled loops change in place."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import Int32Array
from alloc.problems.instance import FloatArray

POOL_BY_SUMS = 32
"""Agents in one exchange where sums of abilities are integers."""

POOL_ENUMERATED = 12
"""Agents in one exchange where all subsets are enumerated."""

POOL_TRAVELLING = 8
"""The same where travel takes time, so that abilities depend on the task: cheap exchanges, and many of them."""

POOL_BY_HALVES = 16
"""Agents in one exchange by meeting in the middle; the subsets of both halves must fit into the workspace."""

NOISE_SIZE = 4096
"""Random numbers that are drawn beforehand."""

MOST_SUMS = 1 << 14
"""Sums of abilities that the dynamic programme distinguishes."""

N_SHORT, N_MOVES, FULL_GROUP, N_LOGGED = 0, 1, 2, 3
"""Entries of `Plan.counter`."""

LOG_SIZE = 512
"""Last moves that are kept: those of the longest ejection chain, and those that take it back; a power of two."""

MOST_TOUCHED = 8
"""Groups that an ejection chain changes, at most."""

CURRENT, BEST = 0, 1
"""Entries of `Plan.cost`."""


class Plan(NamedTuple):
    """One allocation; the idle agents are group m.

    Attributes
    ----------
    group_of_agent : ndarray of int, shape (n,)
        Task of each agent, or m.
    slot : ndarray of int
        Members of all groups, with free slots behind those of each group.
    begin : ndarray of int, shape (m + 2,)
        Where the slots of each group begin.
    size : ndarray of int, shape (m + 1,)
        Members of each group.
    position : ndarray of int, shape (n,)
        Index of each agent within its group.
    demand, group_ability : ndarray, shape (m + 1,)
        Ability that each task needs to be done within the target makespan, and that its group has.
    price : ndarray, shape (m + 1,)
        Factor on the penalty of each unit of ability that a task lacks; rises while a task is short.
    short_task, short_position : ndarray of int, shape (m,)
        List of the tasks whose group ability is below their demand, and the position of each task on it, -1 for none.
    best_group, journal : ndarray of int, shape (n,)
        The best assignment so far, and the agents that have moved since it was saved.
    moved, source : ndarray of int, shape (LOG_SIZE,)
        Log of the last moves, in a ring: agents, and the groups that they left.
    counter : ndarray of int, shape (4,)
        Tasks with a shortfall; moves since the best was saved; whether a group has run out of slots; moves in the log.
    cost : ndarray, shape (2,)
        Total cost of flights, of this plan and of the best.
    random : ndarray of uint64, shape (1,)
        State of the random numbers.
    """

    group_of_agent: Int32Array
    slot: Int32Array
    begin: NDArray[np.int64]
    size: Int32Array
    position: Int32Array
    demand: FloatArray
    group_ability: FloatArray
    price: FloatArray
    short_task: Int32Array
    short_position: Int32Array
    best_group: Int32Array
    journal: Int32Array
    moved: Int32Array
    source: Int32Array
    counter: NDArray[np.int64]
    cost: FloatArray
    random: NDArray[np.uint64]


class Workspace(NamedTuple):
    """Buffers of one exchange between a task and another one, and logistic noise.

    Attributes
    ----------
    agent : ndarray of int
        The pool: agents that are reassigned.
    ability, other_ability : ndarray
        What each contributes to the task, and to the other one.
    extra_cost, cost : ndarray
        By how much the flight to the task costs more than that to the other one, as it is, and weighted with noise.
    sum_cost, sum_set : ndarray, shape (2 * MOST_SUMS,)
        Least cost for each sum of abilities, and a subset that has it, as bits; two rows of the dynamic programme.
    subset_ability, subset_other_ability, subset_cost, subset_bits : ndarray
        Subsets of the pool, or of its halves.
    touched, touched_ability, touched_penalty : ndarray
        Groups that an ejection chain changes, with their abilities and penalties before.
    logistic : ndarray, shape (NOISE_SIZE,)
    """

    agent: Int32Array
    ability: FloatArray
    other_ability: FloatArray
    extra_cost: FloatArray
    cost: FloatArray
    sum_cost: FloatArray
    sum_set: NDArray[np.uint64]
    subset_ability: FloatArray
    subset_other_ability: FloatArray
    subset_cost: FloatArray
    subset_bits: NDArray[np.int64]
    touched: Int32Array
    touched_ability: FloatArray
    touched_penalty: FloatArray
    logistic: FloatArray


class Weights(NamedTuple):
    """Weights of the cost of an exchange.

    Attributes
    ----------
    cost, noise : float
        Of the cost of flights, and of the noise on the cost of each agent.
    short_task, shortfall : float
        Penalty of each task with a shortfall, and of each unit of ability that is missing.
    surplus : float
        Ability beyond the demand up to which sums are considered.
    integer_ability : float
        The largest ability where abilities are integers, else ``inf``.
    """

    cost: float
    noise: float
    short_task: float
    shortfall: float
    surplus: float
    integer_ability: float


class Needs(NamedTuple):
    """What two tasks lack without the agents of the pool, and what it costs; the second may be the idle agents.

    Attributes
    ----------
    missing, other_missing : float
        Ability that each lacks.
    price, other_price : float
        Factor on the penalty of each unit, see `Plan.price`.
    all_in_pool, other_all_in_pool : bool
        Whether all agents of a task are in the pool, so that it may become unserved.
    """

    missing: float
    other_missing: float
    price: float
    other_price: float
    all_in_pool: bool
    other_all_in_pool: bool


def group_slots(
    group_of_agent: Int32Array, groups: int, least: NDArray[np.int64]
) -> tuple[Int32Array, NDArray[np.int64], Int32Array, Int32Array]:
    """Return `slot`, `begin`, `size` and `position` of an assignment, with at least `least` slots for each group."""
    n = len(group_of_agent)
    size = np.bincount(group_of_agent, minlength=groups)
    capacity = np.maximum(least, 2 * size)
    capacity[-1] = n
    begin = np.concatenate([[0], np.cumsum(capacity)])
    order = np.argsort(group_of_agent, kind="stable")
    position = np.empty(n, dtype=np.int32)
    position[order] = np.arange(n) - np.repeat(np.cumsum(size) - size, size)
    slot = np.full(begin[-1], -1, dtype=np.int32)
    slot[begin[group_of_agent] + position] = np.arange(n)
    return slot, begin, size.astype(np.int32), position


def idle_plan(n: int, m: int, random: NDArray[np.uint64]) -> Plan:
    """Return a plan in which all agents are idle, without slots yet."""
    int32 = np.int32
    return Plan(
        group_of_agent=np.full(n, m, dtype=int32),
        slot=np.zeros(0, dtype=int32),
        begin=np.zeros(m + 2, dtype=np.int64),
        size=np.zeros(m + 1, dtype=int32),
        position=np.zeros(n, dtype=int32),
        demand=np.zeros(m + 1),
        group_ability=np.zeros(m + 1),
        price=np.ones(m + 1),
        short_task=np.zeros(m, dtype=int32),
        short_position=np.full(m, -1, dtype=int32),
        best_group=np.full(n, m, dtype=int32),
        journal=np.zeros(n, dtype=int32),
        moved=np.zeros(LOG_SIZE, dtype=int32),
        source=np.zeros(LOG_SIZE, dtype=int32),
        counter=np.zeros(4, dtype=np.int64),
        cost=np.zeros(2),
        random=random,
    )


def workspace(seed: int | list[int]) -> Workspace:
    """Return buffers for exchanges, with noise from `seed`."""
    uniform = np.random.default_rng(seed).uniform(1e-9, 1 - 1e-9, NOISE_SIZE)
    ability, other_ability, extra_cost, cost = (np.empty(2 * POOL_BY_SUMS) for _ in range(4))
    subset_ability, subset_other_ability, subset_cost = (np.empty(1 << POOL_ENUMERATED) for _ in range(3))
    return Workspace(
        agent=np.empty(2 * POOL_BY_SUMS, dtype=np.int32),
        ability=ability,
        other_ability=other_ability,
        extra_cost=extra_cost,
        cost=cost,
        sum_cost=np.empty(2 * MOST_SUMS),
        sum_set=np.empty(2 * MOST_SUMS, dtype=np.uint64),
        subset_ability=subset_ability,
        subset_other_ability=subset_other_ability,
        subset_cost=subset_cost,
        subset_bits=np.empty(1 << POOL_ENUMERATED, dtype=np.int64),
        touched=np.zeros(MOST_TOUCHED, dtype=np.int32),
        touched_ability=np.zeros(MOST_TOUCHED),
        touched_penalty=np.zeros(MOST_TOUCHED),
        logistic=np.log(uniform / (1 - uniform)),
    )
