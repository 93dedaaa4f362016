"""Compiled rounds of the coalition-formation game: agents decide, communicate, and adopt the newest partition."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.heuristic.decentralised.utilities import (
    STAY,
    BoolArray,
    GameData,
    best_saving_change,
    best_serving_change,
)
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray, IntArray

ROUNDS, MESSAGES, DECISIONS = 0, 1, 2
"""Entries of `Beliefs.counts`."""


class Beliefs(NamedTuple):
    """The partition that each agent believes in; changed in place.

    A *version* is a partition that at least one agent believes in.

    Attributes
    ----------
    version : ndarray of int, shape (n,)
        Version of each agent.
    n_changes : ndarray of int, shape (n,)
        Number of changes of that version.
    stamp : ndarray, shape (n,)
        Precedence among versions with equal numbers of changes.
    is_content : ndarray of bool, shape (n,)
        Whether the agent has evaluated its version and wants no change.
    is_news : ndarray of bool, shape (n,)
        Whether the version has not been sent to the neighbours yet.
    plans : ndarray of int, shape (2 n, n)
        Task of each agent in each version, -1 for none.
    coverages : ndarray, shape (2 n, m)
        W / h of each task in each version.
    counts : ndarray of int, shape (3,)
        Numbers of rounds, messages and decisions so far.
    """

    version: IntArray
    n_changes: IntArray
    stamp: FloatArray
    is_content: BoolArray
    is_news: BoolArray
    plans: NDArray[np.int32]
    coverages: FloatArray
    counts: IntArray


@compiled
def play(
    rounds: int,
    game: GameData,
    beliefs: Beliefs,
    target: FloatArray,
    saving: bool,
    distance_weight: float,
    stamp_noise: float,
    noise: FloatArray,
) -> bool:
    """Play up to `rounds` rounds; return whether the game is over: no agent wants a change or has news to send.

    Parameters
    ----------
    rounds : int
    game : GameData
    beliefs : Beliefs
    target : ndarray, shape (n,)
        Coverage W / h that each agent regards as sufficient for a task.
    saving : bool
        Whether agents save distance while keeping tasks at `target`, in place of reducing shortfalls.
    distance_weight : float
        Weight of a unit of distance, relative to the shortfall of an unserved task.
    stamp_noise : float
        Weight of the noise on stamps.
    noise : ndarray, shape (p,)
        Random numbers between 0 and 1, used cyclically.

    References
    ----------
    Jang, Shin and Tsourdos (2018), algorithms 1 and 2, doi:10.1109/TRO.2018.2858292.
    """
    n = len(beliefs.version)
    goal, mate, wants = np.empty(n, np.int64), np.empty(n, np.int64), np.zeros(n, np.bool_)
    for _ in range(rounds):
        beliefs.counts[ROUNDS] += 1
        for i in range(n):
            wants[i] = False
            if beliefs.is_content[i]:
                continue
            beliefs.is_content[i] = True
            beliefs.counts[DECISIONS] += 1
            plan, coverage = beliefs.plans[beliefs.version[i]], beliefs.coverages[beliefs.version[i]]
            if saving:
                choice, other, value = best_saving_change(i, plan, coverage, game, target[i])
            else:
                choice, other, value = best_serving_change(i, plan, coverage, game, target[i], distance_weight)
            if choice == STAY:
                continue
            wants[i], goal[i], mate[i] = True, choice, other
            beliefs.n_changes[i] += 1
            beliefs.stamp[i] = value + stamp_noise * noise[beliefs.counts[DECISIONS] % len(noise)]
            beliefs.is_news[i] = True
            beliefs.counts[MESSAGES] += 2 * (other >= 0)  # a proposal, and its acceptance
        if adopt(communicate(game, beliefs), wants, goal, mate, game, beliefs):
            return True
    return False


@compiled
def communicate(game: GameData, beliefs: Beliefs) -> IntArray:
    """Send all news; return whose version each agent adopts: that with the most changes, then the highest stamp."""
    n, n_changes, stamp = len(beliefs.version), beliefs.n_changes, beliefs.stamp
    winner = np.empty(n, np.int64)
    overall = 0
    for i in range(n):
        if game.is_complete:
            beliefs.counts[MESSAGES] += (n - 1) * beliefs.is_news[i]
            if is_newer(i, overall, n_changes, stamp):
                overall = i
            continue
        begin, end = game.neighbour_begin[i], game.neighbour_begin[i + 1]
        beliefs.counts[MESSAGES] += (end - begin) * beliefs.is_news[i]
        best = i
        for k in game.neighbour[begin:end]:
            if is_newer(k, best, n_changes, stamp):
                best = k
        winner[i] = best
    if game.is_complete:
        winner[:] = overall
    return winner


@compiled
def is_newer(one: int, other: int, n_changes: IntArray, stamp: FloatArray) -> bool:
    """Return whether the version of agent `one` takes precedence over that of `other`."""
    if n_changes[one] == n_changes[other]:
        return bool(stamp[one] > stamp[other])
    return bool(n_changes[one] > n_changes[other])


@compiled
def adopt(winner: IntArray, wants: BoolArray, goal: IntArray, mate: IntArray, game: GameData, beliefs: Beliefs) -> bool:
    """Write the winning versions and assign each agent the version that it adopts; return whether there is no news."""
    n, version = len(winner), beliefs.version
    used, slot, free = np.zeros(len(beliefs.plans), np.bool_), np.full(n, -1), 0
    for i in range(n):
        used[version[i]] = True
    for p in winner:
        if slot[p] >= 0:
            continue
        slot[p] = version[p]
        if wants[p]:
            while used[free]:
                free += 1
            used[free] = True
            slot[p] = free
            plan, coverage = beliefs.plans[free], beliefs.coverages[free]
            plan[:], coverage[:] = beliefs.plans[version[p]], beliefs.coverages[version[p]]
            if mate[p] >= 0:
                reassign(mate[p], plan[p], plan, coverage, game)
            reassign(p, goal[p], plan, coverage, game)
    n_changes, stamp = beliefs.n_changes.copy(), beliefs.stamp.copy()
    over = True
    for i in range(n):
        p = winner[i]
        beliefs.n_changes[i], beliefs.stamp[i] = n_changes[p], stamp[p]
        beliefs.is_news[i] = slot[p] != version[i]
        if beliefs.is_news[i]:
            over, beliefs.is_content[i] = False, False
    for i in range(n):
        version[i] = slot[winner[i]]
    return over


@compiled
def reassign(i: int, goal: int, plan: NDArray[np.int32], coverage: FloatArray, game: GameData) -> None:
    """Assign agent `i` to the task `goal`, or to none (-1)."""
    home = int(plan[i])
    plan[i] = goal
    if home >= 0:
        coverage[home] = coverage_of(home, plan, game)
    if goal >= 0:
        coverage[goal] = coverage_of(goal, plan, game)


@compiled
def coverage_of(task: int, plan: NDArray[np.int32], game: GameData) -> float:
    """Return W / h of a task, summed from scratch so that rounding errors do not accumulate."""
    total = 0.0
    for k in range(len(plan)):
        if plan[k] == task:
            total += game.ability[k]
    return total / game.workload[task] if game.workload[task] > 0 else np.inf
