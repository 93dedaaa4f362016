"""A compiled binary tree over tasks, whose nodes have their bounding box and their worst-served task.

The coverage of a task is its group ability divided by its workload, W / h; the worst-served task has the least
coverage, and the least `Tasks.rank` among equals.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled, inlined

LEAF_SIZE = 8
"""Maximum number of tasks in a leaf."""

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class Tree(NamedTuple):
    """A complete binary tree over tasks; the children of node k are 2 k + 1 and 2 k + 2.

    Attributes
    ----------
    begin, end : ndarray of int, shape (nodes,)
        The tasks of each node are ``order[begin:end]``.
    low, high : ndarray, shape (nodes, 3)
        Bounding box; infinite if the position of a task is unknown.
    order : ndarray of int, shape (tasks,)
    leaf : ndarray of int, shape (m,)
        Leaf of each task, -1 for tasks that are not in the tree.
    worst : ndarray of int, shape (nodes,)
        The worst-served task of each node; changed in place.
    """

    begin: Indices
    end: Indices
    low: Floats
    high: Floats
    order: Indices
    leaf: Indices
    worst: Indices


class Tasks(NamedTuple):
    """The tasks and their groups; the last two fields are changed in place.

    Attributes
    ----------
    position : ndarray, shape (m, 3)
        Coordinates as in `Reach`.
    workload : ndarray, shape (m,)
    rank : ndarray of int, shape (m,)
        Precedence among tasks of equal coverage, the largest workload first.
    group_ability, coverage : ndarray, shape (m,)
    """

    position: Floats
    workload: Floats
    rank: Indices
    group_ability: Floats
    coverage: Floats


def build_tree(position: Floats, tasks: Indices) -> Tree:
    """Build a tree by bisecting `tasks` along the widest side of their bounding box, recursively, without `worst`.

    Parameters
    ----------
    position : ndarray, shape (m, 3)
        Positions of all tasks; unknown ones are NaN.
    tasks : ndarray of int
        The tasks in the tree; at least one.
    """
    depth = max(0, int(np.ceil(np.log2(len(tasks) / LEAF_SIZE))))
    nodes = 2 ** (depth + 1) - 1
    begin, end = np.zeros(nodes, dtype=np.intp), np.full(nodes, len(tasks), dtype=np.intp)
    low, high = np.empty((nodes, 3)), np.empty((nodes, 3))
    order, leaf = tasks.copy(), np.full(len(position), -1, dtype=np.intp)
    for level in range(depth + 1):
        here, below = slice(2**level - 1, 2 ** (level + 1) - 1), slice(2 ** (level + 1) - 1, 2 ** (level + 2) - 1)
        node, where = np.repeat(np.arange(2**level), end[here] - begin[here]), position[order]
        unknown = np.logical_or.reduceat(np.isnan(where).any(axis=1), begin[here])[:, None]
        low[here] = np.where(unknown, -np.inf, np.minimum.reduceat(where, begin[here]))
        high[here] = np.where(unknown, np.inf, np.maximum.reduceat(where, begin[here]))
        if level == depth:
            leaf[order] = here.start + node
            break
        axis = np.argmax(high[here] - low[here], axis=1)  # the first axis if a position is unknown
        order = order[np.lexsort((where[np.arange(len(order)), axis[node]], node))]
        middle = (begin[here] + end[here]) // 2
        begin[below] = np.column_stack([begin[here], middle]).ravel()
        end[below] = np.column_stack([middle, end[here]]).ravel()
    return Tree(begin, end, low, high, order, leaf, np.zeros(nodes, dtype=np.intp))


@compiled
def is_worse(one: int, other: int, coverage: Floats, rank: Indices) -> bool:
    """Return whether task `one` is served worse than `other`, or equally and comes first."""
    if coverage[one] == coverage[other]:
        return bool(rank[one] < rank[other])
    return bool(coverage[one] < coverage[other])


@compiled
def update_node(
    node: int, begin: Indices, end: Indices, order: Indices, coverage: Floats, rank: Indices, worst: Indices
) -> None:
    """Set the worst-served task of `node`, whose children are up to date.

    With `worst` earlier among the arguments, the search takes twice as long, as the compiler optimises it less.
    """
    if 2 * node + 2 < len(begin):
        left, right = worst[2 * node + 1], worst[2 * node + 2]
        worst[node] = left if is_worse(left, right, coverage, rank) else right
        return
    best = order[begin[node]]
    for entry in range(begin[node] + 1, end[node]):
        if is_worse(order[entry], best, coverage, rank):
            best = order[entry]
    worst[node] = best


@compiled
def update_all(tree: Tree, tasks: Tasks) -> None:
    """Set the worst-served task of every node."""
    for node in range(len(tree.begin) - 1, -1, -1):
        update_node(node, tree.begin, tree.end, tree.order, tasks.coverage, tasks.rank, tree.worst)


@inlined
def update_path(task: int, tree: Tree, tasks: Tasks) -> None:
    """Update the nodes that contain `task`, from its leaf to the root."""
    begin, end, order, worst, coverage, rank = tree.begin, tree.end, tree.order, tree.worst, tasks.coverage, tasks.rank
    node = tree.leaf[task]
    update_node(node, begin, end, order, coverage, rank, worst)
    while node > 0:
        node = (node - 1) // 2
        update_node(node, begin, end, order, coverage, rank, worst)
