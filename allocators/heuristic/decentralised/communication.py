"""Which agents hear each other: the communication graph of the decentralised methods."""

from dataclasses import dataclass

import numpy as np

from alloc.problems import Instance
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Hearing:
    """An undirected graph over agents.

    Attributes
    ----------
    first : ndarray of int, shape (n + 1,)
        Where the neighbours of each agent begin in `neighbour`.
    neighbour : ndarray of int, shape (edges,)
        Neighbours of the agents, one agent after the other; empty where everybody hears everybody.
    part : ndarray of int, shape (n,)
        Connected part that each agent belongs to; what is said in one is never heard in another.
    everybody : bool
        Whether everybody hears everybody.
    """

    first: IntArray
    neighbour: IntArray
    part: IntArray
    everybody: bool

    @property
    def parts(self) -> int:
        """Number of connected parts."""
        return int(self.part.max()) + 1

    @property
    def degree(self) -> IntArray:
        """Number of neighbours of each agent, shape (n,)."""
        n = len(self.part)
        return np.full(n, n - 1) if self.everybody else np.diff(self.first)


def hearing(instance: Instance, radius: float | None = None) -> Hearing:
    """Return who hears whom: agents that lie within each other's communication range at the start.

    An agent whose place is unknown hears everybody, as distances to it count as 0 elsewhere, too.

    Parameters
    ----------
    instance : Instance
    radius : float, optional
        One range for all, in units of distance, instead of those of the instance.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n, place = instance.n, instance.start_position
    span = instance.communication_range if radius is None else np.full(n, float(radius))
    known = np.flatnonzero(~np.isnan(place).any(axis=1))
    if not len(known) or _diagonal(place[known]) <= span[known].min():
        nobody = np.zeros(0, dtype=np.intp)
        return Hearing(np.zeros(n + 1, dtype=np.intp), nobody, np.zeros(n, dtype=np.intp), True)
    pairs = np.concatenate([_near(place, span, known), _with_lost(np.setdiff1d(np.arange(n), known), n)])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    graph = csr_array((np.ones(len(both), dtype=np.int8), (both[:, 0], both[:, 1])), shape=(n, n))
    _, part = connected_components(graph, directed=False)
    return Hearing(graph.indptr.astype(np.intp), graph.indices.astype(np.intp), part.astype(np.intp), False)


def _near(place: FloatArray, span: FloatArray, known: IntArray) -> IntArray:
    """Return the pairs within each other's range, shape (pairs, 2)."""
    from scipy.spatial import KDTree

    longest = min(float(span[known].max()), _diagonal(place[known])) + TOLERANCE
    pairs = known[KDTree(place[known]).query_pairs(longest, output_type="ndarray")]
    apart = np.linalg.norm(place[pairs[:, 0]] - place[pairs[:, 1]], axis=1)
    near: IntArray = pairs[apart <= span[pairs].min(axis=1) + TOLERANCE]
    return near


def _with_lost(lost: IntArray, n: int) -> IntArray:
    """Return the pairs of agents at unknown places with everybody else, each pair once."""
    pairs = np.column_stack([np.repeat(lost, n), np.tile(np.arange(n), len(lost))])
    once = ~np.isin(pairs[:, 1], lost) | (pairs[:, 0] < pairs[:, 1])
    mixed: IntArray = pairs[once]
    return mixed


def _diagonal(place: FloatArray) -> float:
    """Return the diagonal of the box around all places: no two are farther apart."""
    return float(np.linalg.norm(np.ptp(place, axis=0)))
