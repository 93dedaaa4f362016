"""Clusters of nearby tasks, whose joint knapsack strengthens the Lagrangian bound."""

from dataclasses import dataclass

import numpy as np
from scipy.cluster.hierarchy import linkage
from scipy.sparse import csr_array
from scipy.spatial.distance import squareform

from alloc.allocators.exact.energy.energy_model import EnergyModel, Mask
from alloc.allocators.exact.knapsack import WholeArray
from alloc.problems.instance import FloatArray


def pairwise_distance(place: FloatArray) -> FloatArray:
    """Return the distances between all pairs of places, shape (t, t), scaled if coordinates are large."""
    known = np.nan_to_num(place)
    known = known / max(1.0, float(np.abs(known).max(initial=0.0)))
    return np.asarray(np.sqrt(((known[:, None] - known[None]) ** 2).sum(axis=2)))


def cluster_tasks(task_distance: FloatArray) -> Mask:
    """Return clusters of up to a quarter of the tasks by average linkage, one per row of members, shape (f, t).

    Larger clusters take long and hardly raise the bound.
    """
    tasks = len(task_distance)
    member = np.vstack([np.eye(tasks, dtype=bool), np.zeros((tasks - 1, tasks), dtype=bool)])
    tree = linkage(squareform(task_distance, checks=False), "average")
    for row, (one, other, _, _) in enumerate(tree, start=tasks):
        member[row] = member[int(one)] | member[int(other)]
    member = member[tasks:]
    small: Mask = member.sum(axis=1) <= max(4, tasks / 4)
    return np.asarray(member[small])


def overlapping_clusters(task_distance: FloatArray, most: int) -> Mask:
    """Return the clusters of `cluster_tasks`, and sets of up to that size of each task and its nearest, shape (f, t).

    There are at most `most` clusters; the largest sets of nearest tasks are left out first.
    """
    nested, near = cluster_tasks(task_distance), np.argsort(task_distance, axis=1, kind="stable")
    tasks, rows = len(task_distance), []
    for size in range(2, int(nested.sum(axis=1).max(initial=0)) + 1):
        row = np.zeros((tasks, tasks), dtype=bool)
        np.put_along_axis(row, near[:, :size], True, axis=1)
        rows.append(row)
        if size * tasks >= 2 * most:  # some of which are duplicates
            break
    together = np.vstack([nested, *rows])
    return np.asarray(together[np.sort(np.unique(together, axis=0, return_index=True)[1])][:most])


@dataclass(frozen=True, eq=False)
class Clusters:
    """Knapsacks of clusters, with an entry for each cluster and class of which some agents may work there.

    Attributes
    ----------
    model : EnergyModel
        The entries as pairs, with clusters in place of tasks; costs are 0.
    link : csr_array, shape (pairs, entries)
        The entries to which each pair of class and task belongs.
    """

    model: EnergyModel
    link: csr_array

    @classmethod
    def build(cls, model: EnergyModel, member: Mask) -> "Clusters":
        """Build the entries of the clusters, which are the rows of `member`, shape (f, t).

        Classes whose agents must all work in one cluster have no entry there; they reduce its need instead.
        """
        assert model.ability is not None
        classes = len(model.count)
        spare = model.max_weight[0] - model.need[0] if model.max_weight[0] >= 0 else -1
        everywhere = np.bincount(model.class_of_pair, minlength=classes)
        need: WholeArray = member.astype(np.int64) @ model.need.astype(np.int64, copy=False)
        parts, rows, columns, entries = [], [], [], 0
        for f, inside in enumerate(member[:, model.task_of_pair]):
            pairs = np.flatnonzero(inside)
            class_of_pair = model.class_of_pair[pairs]
            here = np.bincount(class_of_pair, minlength=classes)
            usable = np.bincount(class_of_pair, model.copies[pairs], classes).astype(np.int64)
            fixed = (here == everywhere) & (model.min_agents == model.count) & (here > 0)
            need[f] -= (model.ability * model.count)[fixed].sum()
            open_class = np.flatnonzero((here > 0) & ~fixed)
            entry = np.full(classes, -1)
            entry[open_class] = entries + np.arange(len(open_class))
            linked = entry[class_of_pair] >= 0
            rows.append(pairs[linked])
            columns.append(entry[class_of_pair[linked]])
            parts.append((open_class, np.full(len(open_class), f), np.minimum(model.count, usable)[open_class]))
            entries += len(open_class)
        agent_class, cluster, copies = (np.concatenate(part) for part in zip(*parts, strict=True))
        row, column = np.concatenate(rows), np.concatenate(columns)
        link = csr_array((np.ones(len(row)), (row, column)), shape=(len(model.class_of_pair), entries))
        return cls(_entries(model, agent_class, cluster, copies, need, spare), link)


def _entries(
    model: EnergyModel, agent_class: WholeArray, cluster: WholeArray, copies: WholeArray, need: WholeArray, spare: int
) -> EnergyModel:
    assert model.ability is not None
    max_weight = need + spare if spare >= 0 else np.full(len(need), -1)
    return EnergyModel(
        class_of_pair=agent_class,
        task_of_pair=cluster,
        weight=model.ability[agent_class],
        copies=copies,
        cost=np.zeros(len(agent_class)),
        need=np.maximum(need, 0),
        max_weight=np.maximum(max_weight, -1),  # if negative there is no plan; the bound also holds without a limit
        count=model.count,
        min_agents=model.min_agents,
        ability=None,
    )
