"""Moves in a drawing: agents grouped by start and task, as wedges that point to the task."""

from dataclasses import dataclass

import numpy as np

from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Flows:
    """Groups of agents with the same start and the same task, in different places.

    Attributes
    ----------
    begin, end : ndarray, shape (k, 3)
        Positions of the start and of the task.
    count : ndarray of int, shape (k,)
        Number of agents.
    """

    begin: FloatArray
    end: FloatArray
    count: IntArray


def two_axes(instance: Instance) -> tuple[int, int]:
    """Return the two axes with the largest spread of positions, in the order x, y, z."""
    places = np.vstack([instance.task_position, instance.start_position])
    spread = np.ptp(places[~np.isnan(places[:, 0])], axis=0)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


def flows(instance: Instance, allocation: Allocation, agents: IntArray | None = None) -> Flows:
    """Group the agents that move, or those of `agents` that do, by start and task."""
    chosen = slice(None) if agents is None else agents
    task = allocation.task_of_agent[chosen]
    begin = instance.start_position[chosen]
    target = instance.task_position[np.maximum(task, 0)]
    moves = (task != IDLE) & ~np.isnan(begin[:, 0]) & ~np.isnan(target[:, 0]) & (begin != target).any(axis=1)
    pairs, count = np.unique(np.hstack([begin[moves], target[moves]]), axis=0, return_counts=True)
    return Flows(pairs[:, :3], pairs[:, 3:], count)


def wedges(moves: Flows, plane: tuple[int, int], extent: float) -> list[FloatArray]:
    """Return one triangle per flow, shape (3, 2): its base at the start, its tip at the task.

    Parameters
    ----------
    plane : (int, int)
        The two axes that are drawn.
    extent : float
        Size of the drawing in units of distance; the width of a wedge is a fraction of it that grows with the square
        root of the number of agents.
    """
    begin, end = moves.begin[:, list(plane)], moves.end[:, list(plane)]
    along = end - begin
    length = np.hypot(along[:, 0], along[:, 1])
    seen = length > 0
    begin, end, along, length = begin[seen], end[seen], along[seen], length[seen]
    across = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    half = np.minimum(0.004 * extent * np.sqrt(moves.count[seen]), 0.02 * extent)[:, None]
    return list(np.stack([begin + half * across, end, begin - half * across], axis=1))
