"""A quick plan for a given T: the shortest task takes over or swaps an agent, as long as that lessens all shortage.

On the paper's scenarios this reaches T = 1 in milliseconds, from the greedy allocation and without a solver.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from alloc.problems.instance import FloatArray, IntArray

DONE = 1 - 1e-12
"""Part of its workload at which a task counts as done; rounding takes the rest."""

EMPTY = 1e-12
"""Part of its workload below which a task counts as served by nobody."""

MOST_SWAPS = 100_000
"""Swaps looked at in one step; beyond, agents are sampled."""


@dataclass(frozen=True, eq=False)
class Descent:
    """The state that is descended: agents per class and task, the last column being the idle ones.

    Attributes
    ----------
    share : ndarray, shape (k, t + 1)
        Part of each task that one agent of each class does; 0 in the last column.
    able : ndarray of bool, shape (k, t + 1)
        Where agents of each class may go.
    counts : ndarray of int, shape (k, t + 1)
        Agents of each class on each task; changed in place.
    cover : ndarray, shape (t + 1,)
        Sum of the shares on each task, 1 in the last column; changed in place.
    """

    share: FloatArray
    able: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
    counts: IntArray
    cover: FloatArray

    @classmethod
    def begin(cls, share: FloatArray, counts: IntArray, free: IntArray) -> "Descent":
        """Start from `counts`, shape (k, t), with `free` idle agents of each class, shape (k,)."""
        idle = np.zeros((len(share), 1))
        padded = np.hstack([share, idle])
        able = padded > 0
        able[:, -1] = True
        table = np.column_stack([counts, free])
        cover = (table * padded).sum(axis=0)
        cover[-1] = 1.0
        return cls(padded, able, table, cover)

    @property
    def shortage(self) -> float:
        """Sum over tasks of the squared missing part."""
        return float(_shortage(self.cover).sum())

    @property
    def reached(self) -> bool:
        """Whether every task is done."""
        return bool(self.cover.min() >= DONE)

    def run(self, rng: np.random.Generator, should_stop: Callable[[], bool]) -> None:
        """Take the best move or swap for the shortest task that has one, until none has."""
        stuck = np.zeros(len(self.cover), dtype=bool)
        while not should_stop():
            task = int(np.where(stuck, np.inf, self.cover).argmin())
            if stuck[task] or self.cover[task] >= DONE:
                return
            change = self._best_change(task, rng)
            if change is None:
                stuck[task] = True
                continue
            self._apply(task, *change)
            stuck[:] = False

    def restore(self, counts: IntArray, cover: FloatArray) -> None:
        """Go back to an earlier state."""
        self.counts[:], self.cover[:] = counts, cover

    def kick(self, rng: np.random.Generator) -> None:
        """Move two to four random agents to random tasks within their reach."""
        for _ in range(int(rng.integers(2, 5))):
            kind, task = divmod(int(rng.choice(np.flatnonzero(self.counts))), self.counts.shape[1])
            goal = int(rng.choice(np.flatnonzero(self.able[kind])))
            self._move(kind, task, goal)

    def _best_change(self, task: int, rng: np.random.Generator) -> tuple[int, int, int] | None:
        """Return who comes to `task` (class and where from) and which class goes there instead (-1: none)."""
        kind, home = np.divmod(np.flatnonzero(self.counts), self.counts.shape[1])
        comes = (home != task) & (self.share[kind, task] > 0)
        kind, home = kind[comes], home[comes]
        leaver = np.flatnonzero(self.counts[:, task])
        if len(kind) * (len(leaver) + 1) > MOST_SWAPS:
            sample = rng.choice(len(kind), max(1, MOST_SWAPS // (len(leaver) + 1)), replace=False)
            kind, home = kind[sample], home[sample]
        if not len(kind):
            return None
        lost = np.concatenate([[0.0], self.share[leaver, task]])
        here = self.cover[task] + self.share[kind, task][:, None] - lost
        given = np.hstack([np.zeros((len(kind), 1)), self.share[leaver][:, home].T])
        there = (self.cover[home] - self.share[kind, home])[:, None] + given
        gain = _shortage(here) + np.where((home == self.counts.shape[1] - 1)[:, None], 0.0, _shortage(there))
        gain -= _shortage(self.cover[task]) + _shortage(self.cover[home])[:, None]
        gain[:, 1:][~self.able[leaver][:, home].T] = np.inf
        best, swap = divmod(int(gain.argmin()), gain.shape[1])
        if gain[best, swap] > -1e-15:
            return None
        return int(kind[best]), int(home[best]), int(leaver[swap - 1]) if swap else -1

    def _apply(self, task: int, kind: int, home: int, leaver: int) -> None:
        self._move(kind, home, task)
        if leaver >= 0:
            self._move(leaver, task, home)

    def _move(self, kind: int, home: int, goal: int) -> None:
        self.counts[kind, home] -= 1
        self.counts[kind, goal] += 1
        for task in {home, goal} - {len(self.cover) - 1}:
            self.cover[task] = self.counts[:, task] @ self.share[:, task]


def _shortage(cover: FloatArray) -> FloatArray:
    """Square of the missing part, and a penalty where nobody is left."""
    missing: FloatArray = np.maximum(0.0, 1 - cover)
    return missing * missing + 1e3 * (cover <= EMPTY)


def descend(
    share: FloatArray,
    counts: IntArray,
    free: IntArray,
    rng: np.random.Generator,
    *,
    kicks: int = 0,
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[IntArray, bool]:
    """Look for a plan that does every task.

    Parameters
    ----------
    share : ndarray, shape (k, t)
        Part of each task that one agent of each class does by the time asked for, at most 1.
    counts : ndarray of int, shape (k, t)
        Agents of each class on each task to begin with.
    free : ndarray of int, shape (k,)
        Idle agents of each class.
    rng : numpy.random.Generator
    kicks : int
        Fresh descents from the best state, shaken.
    should_stop : callable

    Returns
    -------
    ndarray of int, shape (k, t)
        The best counts met.
    bool
        Whether they do every task.
    """
    state = Descent.begin(share, counts, free)
    state.run(rng, should_stop)
    best, table, cover = state.shortage, state.counts.copy(), state.cover.copy()
    for _ in range(kicks):
        if cover.min() >= DONE or should_stop():
            break
        state.kick(rng)
        state.run(rng, should_stop)
        if state.shortage <= best:
            best, table, cover = state.shortage, state.counts.copy(), state.cover.copy()
        else:
            state.restore(table, cover)
    return table[:, :-1], bool(cover.min() >= DONE)
