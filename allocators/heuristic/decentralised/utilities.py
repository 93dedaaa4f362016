"""Compiled decisions of an agent in the coalition-formation game: the move or swap of highest utility.

The coverage of a task is its group ability divided by its workload, W / h.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray, IntArray

EPS = 1e-9
"""Improvement below which an agent does not change."""

ROUNDING = 1e-12
"""Relative tolerance on the least coverage of a task."""

JOIN_PRECEDENCE = 2.0
"""Precedence of an idle agent that joins a coalition, above all other changes, whose gain is at most 1."""

STAY = -2
"""Value in place of a task that stands for no change."""

BoolArray = NDArray[np.bool_]


class GameData(NamedTuple):
    """The constant data of a game, known to all agents.

    Attributes
    ----------
    ability : ndarray, shape (n,)
    origin : ndarray of int, shape (n,)
        Row of each agent in `cost` and `mask`, which are taken from `Reach`.
    cost : ndarray, shape (origins, m)
    mask : ndarray of bool, shape (origins, m)
    workload : ndarray, shape (m,)
    neighbour_begin, neighbour, is_complete
        The `CommunicationGraph`.
    partner_begin, partner : ndarray of int
        Neighbours to which each agent may propose a swap: ``partner[partner_begin[i] : partner_begin[i + 1]]``.
    largest_ability : float
    """

    ability: FloatArray
    origin: IntArray
    cost: FloatArray
    mask: BoolArray
    workload: FloatArray
    neighbour_begin: IntArray
    neighbour: IntArray
    is_complete: bool
    partner_begin: IntArray
    partner: IntArray
    largest_ability: float


@compiled
def shortfall(coverage: float, target: float) -> float:
    """Return the squared relative shortfall of a task, from 0 to 1; convex, so that the worst-served count most."""
    missing = max(0.0, 1.0 - coverage / target)
    return missing * missing


@compiled
def best_serving_change(
    i: int, plan: NDArray[np.int32], coverage: FloatArray, game: GameData, target: float, distance_weight: float
) -> tuple[int, int, float]:
    """Return the task that agent `i` prefers, the agent to swap with (-1 for none), and the precedence.

    The utility is the decrease of the tasks' total shortfall, which is thereby a potential of the game, minus the
    weighted increase of the cost of flights.
    """
    w, row, home = game.ability[i], game.origin[i], int(plan[i])
    workload, mask, cost = game.workload, game.mask, game.cost
    choice, mate, best = STAY, -1, -np.inf
    if home < 0:
        for j in range(len(workload)):
            if workload[j] > 0 and mask[row, j] and coverage[j] < target * (1 - EPS):
                value = 1.0 - coverage[j] / target - distance_weight * cost[row, j]
                if value > best or (value == best and workload[j] > workload[choice]):
                    choice, best = j, value
        if choice >= 0:
            return choice, mate, JOIN_PRECEDENCE + w / game.largest_ability
    here = coverage[home] if home >= 0 else 0.0
    before = shortfall(here, target) if home >= 0 else 0.0
    for j in range(len(workload)):
        if home >= 0 and workload[j] > 0 and mask[row, j] and coverage[j] < here:
            gain = before + shortfall(coverage[j], target)
            gain -= shortfall(here - w / workload[home], target) + shortfall(coverage[j] + w / workload[j], target)
            value = gain - distance_weight * (cost[row, j] - cost[row, home])
            if gain > EPS and value > best:
                choice, best = j, value
    for k in game.partner[game.partner_begin[i] : game.partner_begin[i + 1]]:
        task, other = int(plan[k]), game.origin[k]
        if task == home or (home >= 0 and not mask[other, home]) or (task >= 0 and not mask[row, task]):
            continue
        gain, detour, change = before, 0.0, game.ability[k] - w
        if home >= 0:
            gain -= shortfall(here + change / workload[home], target)
            detour += cost[other, home] - cost[row, home]
        if task >= 0:
            gain += shortfall(coverage[task], target) - shortfall(coverage[task] - change / workload[task], target)
            detour += cost[row, task] - cost[other, task]
        value = gain - distance_weight * detour
        if gain > EPS and value > best:
            choice, mate, best = task, k, value
    return choice, mate, best


@compiled
def best_saving_change(
    i: int, plan: NDArray[np.int32], coverage: FloatArray, game: GameData, target: float
) -> tuple[int, int, float]:
    """Return the change that saves the most cost, in the format of `best_serving_change`.

    No task may fall below the coverage `target`, or below its present coverage if that is lower.
    """
    w, row, home = game.ability[i], game.origin[i], int(plan[i])
    workload, mask, cost = game.workload, game.mask, game.cost
    choice, mate, best = STAY, -1, EPS
    here = coverage[home] if home >= 0 else 0.0
    floor = min(here, target) * (1 - ROUNDING)
    if home >= 0 and here - w / workload[home] >= floor:
        for j in range(-1, len(workload)):
            saved = cost[row, home] - (cost[row, j] if j >= 0 else 0.0)
            if saved > best and (j < 0 or (mask[row, j] and workload[j] > 0)):
                choice, best = j, saved
    for k in game.partner[game.partner_begin[i] : game.partner_begin[i + 1]]:
        task, other = int(plan[k]), game.origin[k]
        if task == home or (home >= 0 and not mask[other, home]) or (task >= 0 and not mask[row, task]):
            continue
        saved, change = 0.0, game.ability[k] - w
        if home >= 0:
            if here + change / workload[home] < floor:
                continue
            saved += cost[row, home] - cost[other, home]
        if task >= 0:
            if coverage[task] - change / workload[task] < min(coverage[task], target) * (1 - ROUNDING):
                continue
            saved += cost[other, task] - cost[row, task]
        if saved > best:
            choice, mate, best = task, k, saved
    return choice, mate, best
