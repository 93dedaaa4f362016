"""Moves on a map: agents grouped by start and task, drawn as wedges that point to the task."""

from dataclasses import dataclass

import numpy as np

from alloc.allocators.plan.places import Places
from alloc.problems import IDLE, Allocation
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Flows:
    """Groups of agents with the same start and the same task, which are at different positions.

    Attributes
    ----------
    begin, end : ndarray, shape (k, 2)
        Positions of the start and of the task.
    count : ndarray of int, shape (k,)
        Number of agents.
    """

    begin: FloatArray
    end: FloatArray
    count: IntArray


def flows(where: Places, allocation: Allocation, agents: IntArray | None = None) -> Flows:
    """Group the moving agents, among `agents` if given, by start and task."""
    chosen = slice(None) if agents is None else agents
    task = allocation.task_of_agent[chosen]
    begin = where.starts[chosen]
    target = where.tasks[np.maximum(task, 0)]
    moves = (task != IDLE) & ~np.isnan(begin[:, 0]) & ~np.isnan(target[:, 0]) & (begin != target).any(axis=1)
    pairs, count = np.unique(np.hstack([begin[moves], target[moves]]), axis=0, return_counts=True)
    return Flows(pairs[:, :2], pairs[:, 2:], count)


def wedges(moves: Flows, extent: float, aspect: float = 1.0) -> list[FloatArray]:
    """Return one triangle per flow, shape (3, 2): its base at the start, its tip at the task.

    Parameters
    ----------
    extent : float
        Size of the drawing in units of its horizontal axis; the width of a wedge is a fraction of it that grows with
        the square root of the number of agents.
    aspect : float
        Drawn length of a unit of the vertical axis over that of a unit of the horizontal axis.
    """
    stretch = np.array([1.0, aspect])
    along = (moves.end - moves.begin) * stretch
    across = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(along[:, 0], along[:, 1])[:, None]
    half = np.minimum(0.004 * extent * np.sqrt(moves.count), 0.02 * extent)[:, None] * across / stretch
    return list(np.stack([moves.begin + half, moves.end, moves.begin - half], axis=1))
