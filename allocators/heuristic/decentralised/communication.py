"""The communication graph of the decentralised methods."""

from dataclasses import dataclass

import numpy as np

from alloc.problems import Instance
from alloc.problems.distances.reach import TOLERANCE
from alloc.problems.instance import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class CommunicationGraph:
    """An undirected graph over agents, in which neighbours exchange messages.

    Attributes
    ----------
    begin : ndarray of int, shape (n + 1,)
        Index in `neighbour` where the neighbours of each agent begin.
    neighbour : ndarray of int, shape (edges,)
        Concatenated neighbours of all agents; empty if the graph is complete.
    component : ndarray of int, shape (n,)
        Connected component of each agent; there are no messages between components.
    is_complete : bool
        Whether all agents are neighbours of each other.
    """

    begin: IntArray
    neighbour: IntArray
    component: IntArray
    is_complete: bool

    @property
    def n_components(self) -> int:
        """Number of connected components."""
        return int(self.component.max()) + 1

    @property
    def degree(self) -> IntArray:
        """Number of neighbours of each agent, shape (n,)."""
        n = len(self.component)
        return np.full(n, n - 1) if self.is_complete else np.diff(self.begin)


def communication_graph(instance: Instance, radius: float | None = None) -> CommunicationGraph:
    """Return the graph of agents within each other's communication range at the start.

    An agent at an unknown position is a neighbour of all, as distances to it count as 0 elsewhere as well.

    Parameters
    ----------
    instance : Instance
    radius : float, optional
        Range of all agents, in units of distance, in place of those of the instance.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    n, position = instance.n, instance.start_position
    reach = instance.communication_range if radius is None else np.full(n, float(radius))
    known = np.flatnonzero(~np.isnan(position).any(axis=1))
    if not len(known) or _diagonal(position[known]) <= reach[known].min():
        no_edges = np.zeros(0, dtype=np.intp)
        return CommunicationGraph(np.zeros(n + 1, dtype=np.intp), no_edges, np.zeros(n, dtype=np.intp), True)
    unknown = np.setdiff1d(np.arange(n), known)
    pairs = np.concatenate([_within_range(position, reach, known), _pairs_with(unknown, n)])
    both = np.concatenate([pairs, pairs[:, ::-1]])
    graph = csr_array((np.ones(len(both), dtype=np.int8), (both[:, 0], both[:, 1])), shape=(n, n))
    _, component = connected_components(graph, directed=False)
    return CommunicationGraph(
        graph.indptr.astype(np.intp), graph.indices.astype(np.intp), component.astype(np.intp), False
    )


def _within_range(position: FloatArray, reach: FloatArray, known: IntArray) -> IntArray:
    """Return the pairs of agents within each other's range, shape (pairs, 2)."""
    from scipy.spatial import KDTree

    longest = min(float(reach[known].max()), _diagonal(position[known])) + TOLERANCE
    pairs = known[KDTree(position[known]).query_pairs(longest, output_type="ndarray")]
    distance = np.linalg.norm(position[pairs[:, 0]] - position[pairs[:, 1]], axis=1)
    near: IntArray = pairs[distance <= reach[pairs].min(axis=1) + TOLERANCE]
    return near


def _pairs_with(agents: IntArray, n: int) -> IntArray:
    """Return all pairs that have at least one of `agents`, each pair once."""
    pairs = np.column_stack([np.repeat(agents, n), np.tile(np.arange(n), len(agents))])
    once = ~np.isin(pairs[:, 1], agents) | (pairs[:, 0] < pairs[:, 1])
    chosen: IntArray = pairs[once]
    return chosen


def _diagonal(position: FloatArray) -> float:
    """Return the diagonal of the bounding box, an upper bound on the distance between two agents."""
    return float(np.linalg.norm(np.ptp(position, axis=0)))
