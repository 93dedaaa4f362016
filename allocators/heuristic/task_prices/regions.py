"""Regions of tasks whose prices rise and fall together: variables by which prices even out over long ways.

Agents can do near tasks alone. With a variable for each task, a quasi-Newton method passes a lack of agents on from
task to task, and needs many iterations for a long way; with one for each region of each size besides, it needs few (a
multilevel preconditioner).

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
"""Of the number of tasks in a region, as the weight of its variable: in a plane, the curvature of the dual along a
factor on the prices of a region grows with the length of its border."""


def regions_of(tree: Tree) -> "csr_array":
    """Return the weight of each region on the logarithm of the price of each task.

    Parameters
    ----------
    tree : Tree
        Over the tasks that have prices; each of its nodes with two or more tasks is a region.

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
