"""Moves in a drawing: who goes where, gathered by place and task, as wedges that point to the task."""

from dataclasses import dataclass

import numpy as np

from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Flows:
    """Moves between two different places.

    Attributes
    ----------
    begin, end : ndarray, shape (k, 3)
        Where the agents come from, and the task that they go to.
    count : ndarray of int, shape (k,)
        How many.
    """

    begin: FloatArray
    end: FloatArray
    count: IntArray


def two_axes(instance: Instance) -> tuple[int, int]:
    """Return the two axes along which the places spread the most, in the order x, y, z."""
    places = np.vstack([instance.task_position, instance.start_position])
    spread = np.ptp(places[~np.isnan(places[:, 0])], axis=0)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


def flows(instance: Instance, allocation: Allocation, agents: IntArray | None = None) -> Flows:
    """Gather the agents (or these of them) that change places by where they begin and where they go."""
    chosen = slice(None) if agents is None else agents
    task = allocation.task_of_agent[chosen]
    begin = instance.start_position[chosen]
    goal = instance.task_position[np.maximum(task, 0)]
    moves = (task != IDLE) & ~np.isnan(begin[:, 0]) & ~np.isnan(goal[:, 0]) & (begin != goal).any(axis=1)
    pairs, count = np.unique(np.hstack([begin[moves], goal[moves]]), axis=0, return_counts=True)
    return Flows(pairs[:, :3], pairs[:, 3:], count)


def wedges(moves: Flows, plane: tuple[int, int], extent: float) -> list[FloatArray]:
    """Return one triangle per flow, shape (3, 2): wide where the agents begin, its tip at the task.

    Parameters
    ----------
    plane : (int, int)
        The axes that are drawn.
    extent : float
        Size of the drawing in units of distance; the width of a wedge is a share of it, growing with the root of the
        number of agents.
    """
    begin, end = moves.begin[:, list(plane)], moves.end[:, list(plane)]
    along = end - begin
    length = np.hypot(along[:, 0], along[:, 1])
    seen = length > 0
    begin, end, along, length = begin[seen], end[seen], along[seen], length[seen]
    across = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    half = np.minimum(0.004 * extent * np.sqrt(moves.count[seen]), 0.02 * extent)[:, None]
    return list(np.stack([begin + half * across, end, begin - half * across], axis=1))
