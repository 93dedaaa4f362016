"""The plan of a search, its workspace and weights, as arrays that compiled loops change in place."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.local_search.instance_arrays import Int32Array
from alloc.problems.instance import FloatArray

POOL_BY_SUMS = 32
"""Maximum number of agents in an exchange if sums of abilities are integers."""

POOL_ENUMERATED = 12
"""Maximum number of agents in an exchange if all subsets are enumerated."""

POOL_TRAVELLING = 8
"""The same with travel times, with which abilities depend on the task: cheap exchanges, but many of them."""

POOL_BY_HALVES = 16
"""Maximum number of agents in an exchange by meeting in the middle; subsets of both halves fit into the workspace."""

NOISE_SIZE = 4096
"""Number of random numbers that are drawn in advance."""

MAX_SUMS = 1 << 14
"""Maximum number of sums of abilities in the dynamic programme."""

N_SHORT, N_MOVES, FULL_GROUP, N_LOGGED = 0, 1, 2, 3
"""Entries of `Plan.counter`."""

LOG_SIZE = 512
"""Number of last moves that are logged, enough for the longest ejection chain and its undoing; a power of two."""

MAX_TOUCHED = 8
"""Maximum number of groups that an ejection chain changes."""

CURRENT, BEST = 0, 1
"""Entries of `Plan.cost`."""


class Plan(NamedTuple):
    """An allocation; group m consists of the idle agents.

    Attributes
    ----------
    group_of_agent : ndarray of int, shape (n,)
        Task of each agent, or m.
    slot : ndarray of int
        Members of all groups, each followed by free slots.
    begin : ndarray of int, shape (m + 2,)
        Index where the slots of each group begin.
    size : ndarray of int, shape (m + 1,)
        Number of members of each group.
    position : ndarray of int, shape (n,)
        Index of each agent within its group.
    demand, group_ability : ndarray, shape (m + 1,)
        Ability that each task needs to meet the target makespan, and that its group has.
    price : ndarray, shape (m + 1,)
        Factor on the penalty of each unit of missing ability; rises while a task is short.
    short_task, short_position : ndarray of int, shape (m,)
        List of the tasks whose group ability is below their demand, and the index of each task in it, -1 for none.
    best_group, journal : ndarray of int, shape (n,)
        The best assignment so far, and the agents that have moved since it was saved.
    moved, source : ndarray of int, shape (LOG_SIZE,)
        Log of the last moves, as a ring buffer: agents, and the groups that they left.
    counter : ndarray of int, shape (4,)
        Tasks with a shortfall; moves since the best was saved; whether a group has run out of slots; moves in the log.
    cost : ndarray, shape (2,)
        Total cost of flights of this plan and of the best.
    random : ndarray of uint64, shape (1,)
        State of the random number generator.
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
    """Buffers of an exchange between two tasks, and logistic noise.

    Attributes
    ----------
    agent : ndarray of int
        The pool of agents that are reassigned.
    ability, other_ability : ndarray
        Contribution of each agent to the first and to the other task.
    extra_cost, cost : ndarray
        Cost of the flight to the first task minus that to the other one, and the same weighted and with noise.
    sum_cost, sum_set : ndarray, shape (2 * MAX_SUMS,)
        Least cost for each sum of abilities, and a subset that attains it, as bits; two rows of the dynamic programme.
    subset_ability, subset_other_ability, subset_cost, subset_bits : ndarray
        Subsets of the pool, or of its halves.
    touched, touched_ability, touched_penalty : ndarray
        Groups that an ejection chain changes, with their previous abilities and penalties.
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
        Weights of the cost of flights, and of the noise on the cost of each agent.
    short_task, shortfall : float
        Penalties of each task with a shortfall, and of each unit of missing ability.
    surplus : float
        Ability beyond the demand up to which sums are considered.
    integer_ability : float
        The largest ability if abilities are integers, else ``inf``.
    """

    cost: float
    noise: float
    short_task: float
    shortfall: float
    surplus: float
    integer_ability: float


class Needs(NamedTuple):
    """Shortfalls of two tasks without the agents of the pool, and their prices; the second may be the idle agents.

    Attributes
    ----------
    missing, other_missing : float
        Missing ability of each task.
    price, other_price : float
        Factor on the penalty of each unit of missing ability, see `Plan.price`.
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
    """Return a plan in which all agents are idle, without slots."""
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
    """Return buffers for exchanges, with noise drawn with `seed`."""
    uniform = np.random.default_rng(seed).uniform(1e-9, 1 - 1e-9, NOISE_SIZE)
    ability, other_ability, extra_cost, cost = (np.empty(2 * POOL_BY_SUMS) for _ in range(4))
    subset_ability, subset_other_ability, subset_cost = (np.empty(1 << POOL_ENUMERATED) for _ in range(3))
    return Workspace(
        agent=np.empty(2 * POOL_BY_SUMS, dtype=np.int32),
        ability=ability,
        other_ability=other_ability,
        extra_cost=extra_cost,
        cost=cost,
        sum_cost=np.empty(2 * MAX_SUMS),
        sum_set=np.empty(2 * MAX_SUMS, dtype=np.uint64),
        subset_ability=subset_ability,
        subset_other_ability=subset_other_ability,
        subset_cost=subset_cost,
        subset_bits=np.empty(1 << POOL_ENUMERATED, dtype=np.int64),
        touched=np.zeros(MAX_TOUCHED, dtype=np.int32),
        touched_ability=np.zeros(MAX_TOUCHED),
        touched_penalty=np.zeros(MAX_TOUCHED),
        logistic=np.log(uniform / (1 - uniform)),
    )
