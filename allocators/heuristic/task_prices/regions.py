"""Regions of tasks whose prices change together: variables that make prices converge over long distances.

Agents can do only near tasks. With one variable per task, a quasi-Newton method propagates a shortage of agents from
task to task, and needs many iterations over long distances; with additional variables for regions of all sizes, it
needs few (a multilevel preconditioner).

References
----------
Bramble, Pasciak and Xu (1990), doi:10.1090/S0025-5718-1990-1023042-6; as redundant variables: Griebel (1994),
doi:10.1137/0915036.
"""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.heuristic.greedy.task_tree import Tree

if TYPE_CHECKING:
    from scipy.sparse import csr_array

EXPONENT = -0.25
"""Exponent of the number of tasks in a region in the weight of its variable: in a plane, the curvature of the dual
along a common factor on the prices of a region grows with the length of its border."""


def regions_of(tree: Tree) -> "csr_array":
    """Return the weight of each region on the logarithm of the price of each task.

    Parameters
    ----------
    tree : Tree
        Tree over the tasks that have prices; each node with two or more tasks is a region.

    Returns
    -------
    csr_array, shape (tasks of the tree, regions)
        Rows in the order of the tasks' numbers.
    """
    from scipy.sparse import csr_array

    size = tree.end - tree.begin
    nodes = np.flatnonzero(size > 1)
    count = size[nodes]
    region = np.repeat(np.arange(len(nodes)), count)
    entry = np.arange(len(region)) + np.repeat(tree.begin[nodes] - np.cumsum(count) + count, count)
    row = np.empty(len(tree.order), dtype=np.intp)
    row[np.argsort(tree.order)] = np.arange(len(tree.order))
    weight = np.repeat(count**EXPONENT, count)
    return csr_array((weight, (row[entry], region)), shape=(len(tree.order), len(nodes)))
