"""Partitions of the tasks into regions of neighbours, or of tasks through which agents can reach a shortfall."""

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra

from alloc.problems import IDLE
from alloc.problems.game.candidates import Candidates

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

SPREAD = (0.6, 1.4)
"""Minimum and maximum random factor on distances, and on the lengths of edges, which varies the regions."""


def partition(
    position: Floats,
    surplus: Floats,
    size: int,
    rng: np.random.Generator,
    random_share: float = 0.0,
    graph: scipy.sparse.csr_array | None = None,
) -> Ints:
    """Partition tasks into regions of neighbours, shape (regions, size); some tasks may be left over.

    Each region consists of a task and the remaining tasks that are nearest to it by perturbed distances. If there are
    tasks with a shortfall, only these get a region, with the nearest tasks whose surplus compensates for it and, given
    a graph, the tasks on the paths from there.

    Parameters
    ----------
    position : ndarray, shape (m, 3)
    surplus : ndarray, shape (m,)
        Surplus of each task; negative for a shortfall.
    size : int
        Number of tasks of a region.
    random_share : float
        Share of the regions that consist of random tasks.
    graph : sparse array, shape (m, m), optional
        Distances from a task with a shortfall are shortest paths in this graph instead of those in space; see
        `reach_graph`.
    """
    m = len(position)
    position = np.nan_to_num(position)
    free = np.ones(m, dtype=bool)
    regions = []
    short = np.flatnonzero(surplus < 0)
    for centre in rng.permutation(short if len(short) else m).tolist():
        if not free[centre]:
            continue
        if free.sum() < size:
            break
        away = np.sqrt(((position - position[centre]) ** 2).sum(1)) * rng.uniform(*SPREAD, m)
        predecessor = None
        if rng.random() < random_share:
            away = rng.random(m)
        elif graph is not None and surplus[centre] < 0:
            along, predecessor = dijkstra(graph, indices=centre, return_predecessors=True)
            away = np.where(np.isfinite(along), along, away + SPREAD[1] * m)
        away[~free], away[centre] = np.inf, -2.0
        if surplus[centre] < 0:
            away[_helpers(centre, away, surplus, predecessor, size - 1)] = -1.0
        region = np.argpartition(away, size - 1)[:size]
        free[region] = False
        regions.append(region)
    return np.array(regions, dtype=np.int64).reshape(-1, size)


def _helpers(centre: int, away: Floats, surplus: Floats, predecessor: Ints | None, room: int) -> list[int]:
    """Return the nearest tasks with a surplus, until they compensate for the shortfall, and the tasks on the paths."""
    shortfall, chosen = -surplus[centre], set[int]()
    able = np.flatnonzero((surplus > 0) & np.isfinite(away))
    for helper in able[np.argsort(away[able])].tolist():
        path = [helper] if predecessor is None else _path(predecessor, helper, centre)
        if not path or not np.isfinite(away[path]).all() or len(chosen.union(path)) > room:
            continue
        chosen.update(path)
        shortfall -= surplus[helper]
        if shortfall <= 0 or len(chosen) == room:
            break
    return sorted(chosen)


def _path(predecessor: Ints, first: int, last: int) -> list[int]:
    """Return the tasks on the path from `first` to `last`, without the last; empty if there is no path."""
    path = []
    while first != last:
        if first < 0:
            return []
        path.append(first)
        first = int(predecessor[first])
    return path


def reach_graph(near: Candidates, plan: Ints, m: int, rng: np.random.Generator) -> scipy.sparse.csr_array:
    """Return a graph with an edge from each task to those whose agents could do it, shape (m, m).

    Parameters
    ----------
    near : Candidates
        Candidates of each agent; see `candidate_tasks`.
    plan : ndarray of int, shape (n,)
        Task of each agent, `IDLE` for none.
    m : int
        Number of tasks.
    """
    place, legal = near.place, near.legal
    here = np.broadcast_to(plan[:, None], place.shape)
    linked = legal & (here != IDLE) & (place != here) & (place < m)
    pairs = np.unique(place[linked] * m + here[linked])
    return scipy.sparse.csr_array((rng.uniform(*SPREAD, len(pairs)), (pairs // m, pairs % m)), shape=(m, m))
