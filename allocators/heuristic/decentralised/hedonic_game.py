"""Rounds of the coalition-formation game, compiled: decide on what one knows, tell the neighbours, adopt the newest."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray, IntArray

EPS = 1e-9
"""Improvement below which an agent stays where it is."""

ROUNDING = 1e-12
"""Relative amount by which a task may miss its floor."""

JOIN = 2.0
"""Precedence of an agent that joins over one that changes; the gain of a change is at most 1."""

STAY = -2
"""In place of a task: no change."""

BoolArray = NDArray[np.bool_]


class World(NamedTuple):
    """What everybody knows from the beginning; `aim` has W / h beyond which no task needs more, as each agent sees it.

    The `partner` of agent i from ``partner_first[i]`` on are the neighbours that it may offer an exchange to;
    `neighbour` and `first` are those of `Hearing`, and `loud` says that everybody hears everybody.
    """

    ability: FloatArray
    origin: IntArray
    distance: FloatArray
    mask: BoolArray
    workload: FloatArray
    first: IntArray
    neighbour: IntArray
    loud: bool
    partner_first: IntArray
    partner: IntArray
    largest: float


class Minds(NamedTuple):
    """What each agent knows and thinks; changed in place.

    A *version* is a partition that somebody knows: a row of `plans` (task of each agent, -1 for none), shape (2 n, n),
    and of `covers` (W / h of each task), shape (2 n, m). Each of shape (n,) are `knows`, the version of each agent;
    `evolution`, how often that was changed; `stamp`, what decides between versions that were so equally often;
    `settled`, whether the agent has looked at it and stays; and `fresh`, whether it is news to the neighbours.
    `tally` counts rounds, messages and decisions, shape (3,).
    """

    knows: IntArray
    evolution: IntArray
    stamp: FloatArray
    settled: BoolArray
    fresh: BoolArray
    plans: NDArray[np.int32]
    covers: FloatArray
    tally: IntArray


@compiled
def play(
    rounds: int,
    world: World,
    minds: Minds,
    aim: FloatArray,
    saving: bool,
    thrift: float,
    jitter: float,
    noise: FloatArray,
) -> bool:
    """Play up to `rounds` rounds; return whether the game is over: nobody wants a change, and nothing is news.

    Parameters
    ----------
    rounds : int
    world : World
    minds : Minds
    aim : ndarray, shape (n,)
        W / h beyond which no task needs more, as each agent sees it.
    saving : bool
        Whether agents fly less and leave no task below `aim`, or cover tasks.
    thrift : float
        Weight of a unit of distance against a task that lacks everything.
    jitter : float
        Weight of chance in the stamps.
    noise : ndarray, shape (p,)
        Random numbers from 0 to 1, used over and over.

    References
    ----------
    Jang, Shin and Tsourdos (2018), algorithms 1 and 2, doi:10.1109/TRO.2018.2858292.
    """
    n = len(minds.knows)
    goal, mate, wants = np.empty(n, np.int64), np.empty(n, np.int64), np.zeros(n, np.bool_)
    for _ in range(rounds):
        minds.tally[0] += 1
        for i in range(n):
            wants[i] = False
            if minds.settled[i]:
                continue
            minds.settled[i] = True
            minds.tally[2] += 1
            plan, cover = minds.plans[minds.knows[i]], minds.covers[minds.knows[i]]
            if saving:
                choice, other, value = cheaper(i, plan, cover, world, aim[i])
            else:
                choice, other, value = better(i, plan, cover, world, aim[i], thrift)
            if choice == STAY:
                continue
            wants[i], goal[i], mate[i] = True, choice, other
            minds.evolution[i] += 1
            minds.stamp[i] = value + jitter * noise[minds.tally[2] % len(noise)]
            minds.fresh[i] = True
            minds.tally[1] += 2 * (other >= 0)  # an offer, and its acceptance
        if adopt(heard(world, minds), wants, goal, mate, world, minds):
            return True
    return False


@compiled
def heard(world: World, minds: Minds) -> IntArray:
    """Let those with news speak, and return whose version wins at each agent: most changes, then the highest stamp."""
    n, evolution, stamp = len(minds.knows), minds.evolution, minds.stamp
    winner = np.empty(n, np.int64)
    loudest = 0
    for i in range(n):
        if world.loud:
            minds.tally[1] += (n - 1) * minds.fresh[i]
            if evolution[i] > evolution[loudest] or (evolution[i] == evolution[loudest] and stamp[i] > stamp[loudest]):
                loudest = i
            continue
        begin, end = world.first[i], world.first[i + 1]
        minds.tally[1] += (end - begin) * minds.fresh[i]
        best = i
        for k in world.neighbour[begin:end]:
            if evolution[k] > evolution[best] or (evolution[k] == evolution[best] and stamp[k] > stamp[best]):
                best = k
        winner[i] = best
    if world.loud:
        winner[:] = loudest
    return winner


@compiled
def adopt(winner: IntArray, wants: BoolArray, goal: IntArray, mate: IntArray, world: World, minds: Minds) -> bool:
    """Write the winning versions down, and give each agent the one that won there; return whether none is news."""
    n, knows = len(winner), minds.knows
    used, slot, free = np.zeros(len(minds.plans), np.bool_), np.full(n, -1), 0
    for i in range(n):
        used[knows[i]] = True
    for p in winner:
        if slot[p] >= 0:
            continue
        slot[p] = knows[p]
        if wants[p]:
            while used[free]:
                free += 1
            used[free] = True
            slot[p] = free
            plan, cover = minds.plans[free], minds.covers[free]
            plan[:], cover[:] = minds.plans[knows[p]], minds.covers[knows[p]]
            if mate[p] >= 0:
                send(mate[p], plan[p], plan, cover, world)
            send(p, goal[p], plan, cover, world)
    evolution, stamp = minds.evolution.copy(), minds.stamp.copy()
    over = True
    for i in range(n):
        p = winner[i]
        minds.evolution[i], minds.stamp[i] = evolution[p], stamp[p]
        minds.fresh[i] = slot[p] != knows[i]
        if minds.fresh[i]:
            over, minds.settled[i] = False, False
    for i in range(n):
        knows[i] = slot[winner[i]]
    return over


@compiled
def send(i: int, goal: int, plan: NDArray[np.int32], cover: FloatArray, world: World) -> None:
    """Send agent `i` to `goal`, or nowhere."""
    home = int(plan[i])
    plan[i] = goal
    if home >= 0:
        cover[home] = coverage(home, plan, world)
    if goal >= 0:
        cover[goal] = coverage(goal, plan, world)


@compiled
def coverage(task: int, plan: NDArray[np.int32], world: World) -> float:
    """Return W / h of a task, summed afresh so that no rounding piles up."""
    total = 0.0
    for k in range(len(plan)):
        if plan[k] == task:
            total += world.ability[k]
    return total / world.workload[task] if world.workload[task] > 0 else np.inf


@compiled
def lack(cover: float, aim: float) -> float:
    """Return how badly a task is served, from 0 to 1; convex, so that the worst served counts most."""
    missing = max(0.0, 1.0 - cover / aim)
    return missing * missing


@compiled
def better(
    i: int, plan: NDArray[np.int32], cover: FloatArray, world: World, aim: float, thrift: float
) -> tuple[int, int, float]:
    """Return where agent `i` would rather be, with whom it would change places (-1: nobody), and its precedence.

    What it weighs is what it is worth to the tasks: by how much their lack falls. That is a potential of the game.
    """
    w, row, home = world.ability[i], world.origin[i], int(plan[i])
    workload, mask, distance = world.workload, world.mask, world.distance
    choice, mate, best = STAY, -1, -np.inf
    if home < 0:
        for j in range(len(workload)):
            if workload[j] > 0 and mask[row, j] and cover[j] < aim * (1 - EPS):
                value = 1.0 - cover[j] / aim - thrift * distance[row, j]
                if value > best or (value == best and workload[j] > workload[choice]):
                    choice, best = j, value
        if choice >= 0:
            return choice, mate, JOIN + w / world.largest
    here = cover[home] if home >= 0 else 0.0
    before = lack(here, aim) if home >= 0 else 0.0
    for j in range(len(workload)):
        if home >= 0 and workload[j] > 0 and mask[row, j] and cover[j] < here:
            gain = before + lack(cover[j], aim)
            gain -= lack(here - w / workload[home], aim) + lack(cover[j] + w / workload[j], aim)
            value = gain - thrift * (distance[row, j] - distance[row, home])
            if gain > EPS and value > best:
                choice, best = j, value
    for k in world.partner[world.partner_first[i] : world.partner_first[i + 1]]:
        task, other = int(plan[k]), world.origin[k]
        if task == home or (home >= 0 and not mask[other, home]) or (task >= 0 and not mask[row, task]):
            continue
        gain, detour, change = before, 0.0, world.ability[k] - w
        if home >= 0:
            gain -= lack(here + change / workload[home], aim)
            detour += distance[other, home] - distance[row, home]
        if task >= 0:
            gain += lack(cover[task], aim) - lack(cover[task] - change / workload[task], aim)
            detour += distance[row, task] - distance[other, task]
        value = gain - thrift * detour
        if gain > EPS and value > best:
            choice, mate, best = task, k, value
    return choice, mate, best


@compiled
def cheaper(i: int, plan: NDArray[np.int32], cover: FloatArray, world: World, aim: float) -> tuple[int, int, float]:
    """Return where agent `i` flies less, as `better` does, with no task brought below `aim`, or lower than it is."""
    w, row, home = world.ability[i], world.origin[i], int(plan[i])
    workload, mask, distance = world.workload, world.mask, world.distance
    choice, mate, best = STAY, -1, EPS
    here = cover[home] if home >= 0 else 0.0
    floor = min(here, aim) * (1 - ROUNDING)
    if home >= 0 and here - w / workload[home] >= floor:
        for j in range(-1, len(workload)):
            saved = distance[row, home] - (distance[row, j] if j >= 0 else 0.0)
            if saved > best and (j < 0 or (mask[row, j] and workload[j] > 0)):
                choice, best = j, saved
    for k in world.partner[world.partner_first[i] : world.partner_first[i + 1]]:
        task, other = int(plan[k]), world.origin[k]
        if task == home or (home >= 0 and not mask[other, home]) or (task >= 0 and not mask[row, task]):
            continue
        saved, change = 0.0, world.ability[k] - w
        if home >= 0:
            if here + change / workload[home] < floor:
                continue
            saved += distance[row, home] - distance[other, home]
        if task >= 0:
            if cover[task] - change / workload[task] < min(cover[task], aim) * (1 - ROUNDING):
                continue
            saved += distance[other, task] - distance[row, task]
        if saved > best:
            choice, mate, best = task, k, saved
    return choice, mate, best
