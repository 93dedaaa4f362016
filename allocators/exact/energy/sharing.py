"""Descent on energy by sharing out the agents of two tasks anew, the best way of all: a very large neighbourhood.

Which of their agents two tasks get each is a knapsack: exact by dynamic programming, in microseconds where needs are
small whole numbers. So are a task and those who stay idle. A state that no such step improves is shaken: around one
task, distances get noise for one descent; the result is kept if it is better, or by the rule of annealing.

The exchanges of the local search (`heuristic.local`) are much the same neighbourhood. As the plan side of the exact
methods they were no better: of the paper's scenario 1, in 3 s on two threads of a busy machine, three of ten seeds took
1.0, 1.4 and 2.4 % more energy, none markedly less; on scenarios 2 to 4 either came out ahead, by 1.1 % at most.

References
----------
Ahuja, Ergun, Orlin and Punnen (2002), A survey of very large-scale neighborhood search techniques,
doi:10.1016/S0166-218X(01)00338-9. Charon and Hudry (1993), The noising method, doi:10.1016/0167-6377(93)90023-A.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.exact.makespan.patterns import WholeArray
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.bounds import scale_to_one, typical_distance
from alloc.problems.instance import FloatArray, IntArray

Mask = NDArray[np.bool_]


@compiled
def share_out(
    a: int, b: int, task: WholeArray, weight: WholeArray, distance: FloatArray, need: WholeArray, noise: FloatArray
) -> bool:
    """Share out the agents of tasks `a` and `b` between them at the least cost; whether that changed anything.

    Task number ``len(need) - 1`` stands for idleness: it needs nothing. Distances are ``inf`` where an agent cannot go.
    """
    pool, free, total, fixed, old = np.empty(len(task), dtype=np.int64), 0, 0, 0, 0.0
    for i in range(len(task)):
        if task[i] == a or task[i] == b:
            total += weight[i]
            if distance[i, b] == np.inf:
                fixed += weight[i]
            elif distance[i, a] < np.inf:
                pool[free] = i
                free += 1
    least, most = max(0, need[a] - fixed), total - need[b] - fixed
    if most < least or free == 0:
        return False
    movable = 0
    for q in range(free):
        movable += weight[pool[q]]
    most = min(most, movable)
    cost, after = np.full(most + 1, np.inf), np.empty(most + 1)
    cost[0] = 0.0
    taken = np.zeros((free, most + 1), dtype=np.uint8)
    for q in range(free):
        i, row = pool[q], taken[q]
        w, paid = weight[i], distance[i, a] - distance[i, b] + noise[i, a] - noise[i, b]
        if task[i] == a:
            old += paid
        for s in range(min(w, most + 1)):
            after[s] = cost[s]
        for s in range(w, most + 1):
            candidate = cost[s - w] + paid
            better = candidate < cost[s]
            after[s] = candidate if better else cost[s]
            row[s] = better
        cost, after = after, cost
    best = least
    for s in range(least, most + 1):
        if cost[s] < cost[best]:
            best = s
    if best > most or not cost[best] < old - 1e-12 * (1.0 + abs(old)):
        return False
    for q in range(free - 1, -1, -1):
        i = pool[q]
        if taken[q, best]:
            task[i] = a
            best -= weight[i]
        else:
            task[i] = b
    return True


@compiled
def descend_pairs(
    task: WholeArray,
    weight: WholeArray,
    distance: FloatArray,
    need: WholeArray,
    noise: FloatArray,
    pairs: WholeArray,
    stale: Mask,
    rng: np.random.Generator,
    rounds: int,
) -> None:
    """Share out pair after pair, in random order, until no pair with a `stale` task improves."""
    for _ in range(rounds):
        now, again = stale.copy(), False
        for j in range(len(stale)):
            stale[j] = False
        first = int(rng.random() * len(pairs))
        for z in range(len(pairs)):
            a, b = pairs[(first + z) % len(pairs)]
            if (now[a] or now[b] or stale[a] or stale[b]) and share_out(a, b, task, weight, distance, need, noise):
                stale[a] = stale[b] = again = True
        if not again:
            break


@compiled
def flown(task: WholeArray, distance: FloatArray) -> float:
    """Return the sum of distances."""
    total = 0.0
    for i in range(len(task)):
        total += distance[i, task[i]]
    return total


@compiled
def overwrite(target: WholeArray, source: WholeArray) -> None:
    """Copy `source`; a loop compiles faster than an assignment to a slice."""
    for i in range(len(source)):
        target[i] = source[i]


@compiled
def shake(
    task: WholeArray,
    best: WholeArray,
    weight: WholeArray,
    distance: FloatArray,
    need: WholeArray,
    pairs: WholeArray,
    near: WholeArray,
    noise: FloatArray,
    rng: np.random.Generator,
    rounds: int,
    strength: float,
    heat: float,
) -> None:
    """Shake and descend `rounds` times; `task` is where the walk stands, `best` the best met, both changed in place.

    Parameters
    ----------
    near : ndarray of int, shape (tasks, q)
        The nearest tasks of each task, itself first.
    noise : ndarray, shape (n, tasks + 1)
        Zeros; so again at the end.
    strength, heat : float
        Largest noise, and temperature, both in units of distance.
    """
    least, here = flown(best, distance), flown(task, distance)
    before, stale = task.copy(), np.zeros(len(need), dtype=np.bool_)
    for _ in range(rounds):
        centre, size = int(rng.random() * len(near)), 2 + int(rng.random() * (near.shape[1] - 1))
        around, amplitude = near[centre, : min(size, near.shape[1])], strength * rng.random()
        inside = np.zeros(len(need), dtype=np.bool_)
        for j in around:
            inside[j] = True
            for i in range(len(task)):
                noise[i, j] = amplitude * (rng.random() + rng.random() - 1.0)
        for a, b in pairs:
            if inside[a] and (inside[b] or b == len(need) - 1):
                share_out(a, b, task, weight, distance, need, noise)
        for j in around:
            for i in range(len(task)):
                noise[i, j] = 0.0
        for j in range(len(stale)):
            stale[j] = inside[j]
        descend_pairs(task, weight, distance, need, noise, pairs, stale, rng, 100)
        now = flown(task, distance)
        if now <= here or rng.random() < np.exp((here - now) / heat):
            here = now
            overwrite(before, task)
            if now < least * (1 - 1e-12):
                least = now
                overwrite(best, task)
        else:
            overwrite(task, before)


@dataclass(frozen=True)
class Shaking:
    """How the walk is shaken.

    Attributes
    ----------
    around : int
        Tasks shaken at once, at most.
    partners : int
        Nearest tasks that a task shares agents with.
    strength, heat : float
        Largest noise, and temperature to begin with, as multiples of the mean flight of an agent.
    """

    around: int = 8
    partners: int = 64
    strength: float = 10.0
    heat: float = 0.3


class Sharing:
    """A walk over plans in which every task has what it needs, towards less energy.

    Parameters
    ----------
    task : ndarray of int, shape (n,)
        Task of each agent to begin with, ``len(need)`` for idle ones.
    weight : ndarray of int, shape (n,)
        What each agent adds to its task, whatever the task.
    distance : ndarray, shape (n, t)
        ``inf`` where an agent cannot go.
    need : ndarray of int, shape (t,)
    apart : ndarray, shape (t, t)
        How far tasks are from each other; only near ones are shaken together.
    seed : int
    shaking : Shaking
    """

    def __init__(
        self,
        task: IntArray,
        weight: IntArray,
        distance: FloatArray,
        need: IntArray,
        apart: FloatArray,
        seed: int,
        shaking: Shaking = Shaking(),
    ) -> None:
        tasks, idle = len(need), np.zeros((len(task), 1))
        self._shaking, self._rng = shaking, np.random.default_rng(seed)
        self._task = task.astype(np.int64)
        self._weight = weight.astype(np.int64)
        self._scale = scale_to_one(typical_distance(distance))
        self._distance = np.ascontiguousarray(np.hstack([distance * self._scale, idle]))
        self._need = np.append(need, 0).astype(np.int64)
        order = np.argsort(apart, axis=1, kind="stable").astype(np.int64)
        self._near = np.ascontiguousarray(order[:, : shaking.around])
        self._pairs = _pairs(order[:, : shaking.partners], tasks)
        self._noise = np.zeros_like(self._distance)
        self._stale = np.ones(len(self._need), dtype=np.bool_)
        self.best = self._task.copy()

    @property
    def cost(self) -> float:
        """Sum of distances of the best plan."""
        return float(flown(self.best, self._distance)) / self._scale

    def descend(self) -> bool:
        """Go through all pairs of tasks once; whether none can be shared out better any more."""
        descend_pairs(
            self._task, self._weight, self._distance, self._need, self._noise, self._pairs, self._stale, self._rng, 1
        )
        self.best = self._task.copy()
        return not self._stale.any()

    def walk(self, rounds: int, cooled: float) -> None:
        """Shake and descend `rounds` times, `cooled` being how far annealing is, from 0 to 1."""
        unit = self.cost * self._scale / len(self._task) + 1e-300
        shake(
            self._task,
            self.best,
            self._weight,
            self._distance,
            self._need,
            self._pairs,
            self._near,
            self._noise,
            self._rng,
            rounds,
            self._shaking.strength * unit,
            self._shaking.heat * unit * (1 - cooled) + 1e-300,
        )


def _pairs(partners: WholeArray, tasks: int) -> WholeArray:
    """Tasks that share agents, shape (p, 2), each also with the idle ones."""
    one = np.repeat(np.arange(tasks), partners.shape[1])
    both = np.sort(np.column_stack([one, partners.ravel()]), axis=1)
    both = np.unique(both[both[:, 0] < both[:, 1]], axis=0)
    idle = np.column_stack([np.arange(tasks), np.full(tasks, tasks)])
    return np.ascontiguousarray(np.vstack([both, idle]).astype(np.int64))
