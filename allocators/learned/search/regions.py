"""Which tasks make a part: neighbours, or those on the ways that agents can go to a task that lacks some."""

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from alloc.problems import IDLE
from alloc.problems.game.candidates import Layout

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

SPREAD = (0.6, 1.4)
"""Least and most of what distances, and the lengths of links, are multiplied by, to have other parts each time."""


def cover(
    position: Floats,
    surplus: Floats,
    size: int,
    rng: np.random.Generator,
    far_share: float = 0.0,
    links: scipy.sparse.csr_array | None = None,
) -> Ints:
    """Partition places into groups of neighbours, shape (groups, size); some are left over.

    Each group is made of a place and of those left that are nearest to it, more or less. Where places lack something,
    only they get a group, with the nearest that have as much to spare and, by links, those on the way from there.

    Parameters
    ----------
    position : ndarray, shape (m, 3)
    surplus : ndarray, shape (m,)
        Negative where something is lacking.
    far_share : float
        Share of the groups that are of places anywhere.
    links : sparse array, shape (m, m), optional
        What is near a place that lacks something, in place of positions; see `links_between`.
    """
    m = len(position)
    position = np.nan_to_num(position)
    free = np.ones(m, dtype=bool)
    groups = []
    lacking = np.flatnonzero(surplus < 0)
    for centre in rng.permutation(lacking if len(lacking) else m).tolist():
        if not free[centre]:
            continue
        if free.sum() < size:
            break
        away = np.sqrt(((position - position[centre]) ** 2).sum(1)) * rng.uniform(*SPREAD, m)
        before = None
        if rng.random() < far_share:
            away = rng.random(m)
        elif links is not None and surplus[centre] < 0:
            along, before = dijkstra(links, indices=centre, return_predecessors=True)
            away = np.where(np.isfinite(along), along, away + SPREAD[1] * m)
        away[~free], away[centre] = np.inf, -2.0
        if surplus[centre] < 0:
            away[_helpers(centre, away, surplus, before, size - 1)] = -1.0
        group = np.argpartition(away, size - 1)[:size]
        free[group] = False
        groups.append(group)
    return np.array(groups, dtype=np.int64).reshape(-1, size)


def _helpers(centre: int, away: Floats, surplus: Floats, before: Ints | None, room: int) -> list[int]:
    """Return the nearest places with a surplus, until they make up for what is lacking, and those on the way."""
    lack, chosen = -surplus[centre], set[int]()
    able = np.flatnonzero((surplus > 0) & np.isfinite(away))
    for helper in able[np.argsort(away[able])].tolist():
        way = [helper] if before is None else _way(before, helper, centre)
        if not way or not np.isfinite(away[way]).all() or len(chosen.union(way)) > room:
            continue
        chosen.update(way)
        lack -= surplus[helper]
        if lack <= 0 or len(chosen) == room:
            break
    return sorted(chosen)


def _way(before: Ints, first: int, last: int) -> list[int]:
    """Return the places from the first to just before the last; none where no way leads there."""
    way = []
    while first != last:
        if first < 0:
            return []
        way.append(first)
        first = int(before[first])
    return way


def links_between(near: Layout, plan: Ints, m: int, rng: np.random.Generator) -> scipy.sparse.csr_array:
    """Return a graph with an edge from each task to those where somebody works who could come, shape (m, m).

    Parameters
    ----------
    near : Layout
        Candidates of each agent; see `near_tasks`.
    plan : ndarray of int, shape (n,)
        Task of each agent, `IDLE` for none.
    """
    goal, _, legal = near
    here = np.broadcast_to(plan[:, None], goal.shape)
    linked = legal & (here != IDLE) & (goal != here) & (goal < m)
    pairs = np.unique(goal[linked] * m + here[linked])
    return scipy.sparse.csr_array((rng.uniform(*SPREAD, len(pairs)), (pairs // m, pairs % m)), shape=(m, m))
