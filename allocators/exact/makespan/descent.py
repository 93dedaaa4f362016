"""A descent to a plan for a given T: moves or swaps an agent to the task with the largest shortfall while that helps.

The objective is the sum over tasks of the squared shortfall. In the paper's scenarios, this reaches T = 1 from the
greedy allocation within milliseconds, without a solver.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from alloc.problems.instance import FloatArray, IntArray

DONE = 1 - 1e-12
"""Share of its workload from which a task counts as done, to allow for rounding errors."""

EMPTY = 1e-12
"""Share of its workload below which a task counts as unserved."""

MAX_SWAPS = 100_000
"""Number of swaps evaluated in one step; of more, a random sample is drawn."""


@dataclass(frozen=True, eq=False)
class Descent:
    """The state of the descent: agents per class and task, with idle ones in the last column.

    Attributes
    ----------
    share : ndarray, shape (k, t + 1)
        Share of each task that one agent of each class does; 0 in the last column.
    allowed : ndarray of bool, shape (k, t + 1)
        Tasks to which agents of each class may be assigned.
    counts : ndarray of int, shape (k, t + 1)
        Agents of each class on each task; changed in place.
    progress : ndarray, shape (t + 1,)
        Sum of the shares on each task, 1 in the last column; changed in place.
    """

    share: FloatArray
    allowed: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
    counts: IntArray
    progress: FloatArray

    @classmethod
    def begin(cls, share: FloatArray, counts: IntArray, free: IntArray) -> "Descent":
        """Start from `counts`, shape (k, t), with `free` idle agents of each class, shape (k,)."""
        idle = np.zeros((len(share), 1))
        padded = np.hstack([share, idle])
        allowed = padded > 0
        allowed[:, -1] = True
        table = np.column_stack([counts, free])
        progress = (table * padded).sum(axis=0)
        progress[-1] = 1.0
        return cls(padded, allowed, table, progress)

    @property
    def shortfall(self) -> float:
        """Objective: the sum over tasks of the squared shortfall."""
        return float(_shortfall(self.progress).sum())

    @property
    def reached(self) -> bool:
        """Whether every task is done."""
        return bool(self.progress.min() >= DONE)

    def run(self, rng: np.random.Generator, should_stop: Callable[[], bool]) -> None:
        """Repeat the best move or swap for the worst task that has an improving one, until none has."""
        stuck = np.zeros(len(self.progress), dtype=bool)
        while not should_stop():
            task = int(np.where(stuck, np.inf, self.progress).argmin())
            if stuck[task] or self.progress[task] >= DONE:
                return
            change = self._best_change(task, rng)
            if change is None:
                stuck[task] = True
                continue
            self._apply(task, *change)
            stuck[:] = False

    def restore(self, counts: IntArray, progress: FloatArray) -> None:
        """Restore an earlier state."""
        self.counts[:], self.progress[:] = counts, progress

    def kick(self, rng: np.random.Generator) -> None:
        """Move two to four random agents to random tasks within their reach."""
        for _ in range(int(rng.integers(2, 5))):
            agent_class, task = divmod(int(rng.choice(np.flatnonzero(self.counts))), self.counts.shape[1])
            target = int(rng.choice(np.flatnonzero(self.allowed[agent_class])))
            self._move(agent_class, task, target)

    def _best_change(self, task: int, rng: np.random.Generator) -> tuple[int, int, int] | None:
        """Return the class moved to `task`, its origin, and the class moved there in exchange (-1 for none)."""
        agent_class, origin = np.divmod(np.flatnonzero(self.counts), self.counts.shape[1])
        comes = (origin != task) & (self.share[agent_class, task] > 0)
        agent_class, origin = agent_class[comes], origin[comes]
        leaver = np.flatnonzero(self.counts[:, task])
        if len(agent_class) * (len(leaver) + 1) > MAX_SWAPS:
            sample = rng.choice(len(agent_class), max(1, MAX_SWAPS // (len(leaver) + 1)), replace=False)
            agent_class, origin = agent_class[sample], origin[sample]
        if not len(agent_class):
            return None
        lost = np.concatenate([[0.0], self.share[leaver, task]])
        here = self.progress[task] + self.share[agent_class, task][:, None] - lost
        given = np.hstack([np.zeros((len(agent_class), 1)), self.share[leaver][:, origin].T])
        there = (self.progress[origin] - self.share[agent_class, origin])[:, None] + given
        gain = _shortfall(here) + np.where((origin == self.counts.shape[1] - 1)[:, None], 0.0, _shortfall(there))
        gain -= _shortfall(self.progress[task]) + _shortfall(self.progress[origin])[:, None]
        gain[:, 1:][~self.allowed[leaver][:, origin].T] = np.inf
        best, swap = divmod(int(gain.argmin()), gain.shape[1])
        if gain[best, swap] > -1e-15:
            return None
        return int(agent_class[best]), int(origin[best]), int(leaver[swap - 1]) if swap else -1

    def _apply(self, task: int, agent_class: int, origin: int, leaver: int) -> None:
        self._move(agent_class, origin, task)
        if leaver >= 0:
            self._move(leaver, task, origin)

    def _move(self, agent_class: int, origin: int, target: int) -> None:
        self.counts[agent_class, origin] -= 1
        self.counts[agent_class, target] += 1
        for task in {origin, target} - {len(self.progress) - 1}:
            self.progress[task] = self.counts[:, task] @ self.share[:, task]


def _shortfall(progress: FloatArray) -> FloatArray:
    """Return the squared share of each task that is not done, plus a penalty for unserved tasks."""
    part: FloatArray = np.maximum(0.0, 1 - progress)
    return part * part + 1e3 * (progress <= EMPTY)


def descend(
    share: FloatArray,
    counts: IntArray,
    free: IntArray,
    rng: np.random.Generator,
    *,
    kicks: int = 0,
    should_stop: Callable[[], bool] = lambda: False,
) -> tuple[IntArray, bool]:
    """Search for a plan that does every task.

    Parameters
    ----------
    share : ndarray, shape (k, t)
        Share of each task that one agent of each class does by the given time, at most 1.
    counts : ndarray of int, shape (k, t)
        Initial numbers of agents of each class on each task.
    free : ndarray of int, shape (k,)
        Idle agents of each class.
    rng : numpy.random.Generator
    kicks : int
        Number of perturbations of the best state, each followed by a descent.
    should_stop : callable

    Returns
    -------
    ndarray of int, shape (k, t)
        The best counts found.
    bool
        Whether they do every task.
    """
    state = Descent.begin(share, counts, free)
    state.run(rng, should_stop)
    best, table, progress = state.shortfall, state.counts.copy(), state.progress.copy()
    for _ in range(kicks):
        if progress.min() >= DONE or should_stop():
            break
        state.kick(rng)
        state.run(rng, should_stop)
        if state.shortfall <= best:
            best, table, progress = state.shortfall, state.counts.copy(), state.progress.copy()
        else:
            state.restore(table, progress)
    return table[:, :-1], bool(progress.min() >= DONE)
