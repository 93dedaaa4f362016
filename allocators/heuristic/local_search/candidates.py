"""Candidates for exchanges: the tasks near each origin and near each task."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from alloc.allocators.heuristic.local_search.distances import fill_table
from alloc.allocators.heuristic.local_search.instance_arrays import (
    TABLE_LIMIT,
    InstanceArrays,
    Int32Array,
    instance_arrays,
)
from alloc.problems import Instance
from alloc.problems.instance import FloatArray

MAX_ROWS = 100_000
"""Number of origins up to which each has its own candidates; with more, they have those of their nearest task."""

SAMPLE_SIZE = 1000
"""Number of origins for estimating the mean cost of a flight to a candidate."""


class Candidates(NamedTuple):
    """Tasks with which exchanges are tried.

    Attributes
    ----------
    row : ndarray of int, shape (origins,)
        Row of each origin in `of_origin`.
    of_origin : ndarray of int, shape (rows, k)
        Tasks near an origin, -1 for none; with a table of distances, tasks within reach, repeated to fill the row.
    of_task : ndarray of int, shape (m, k)
        Tasks near a task, -1 for none.
    """

    row: Int32Array
    of_origin: Int32Array
    of_task: Int32Array


def arrays_and_candidates(instance: Instance, count: int) -> tuple[InstanceArrays, Candidates]:
    """Return the arrays of an instance, with a table of distances if it fits, and `count` candidates per row."""
    arrays, reach = instance_arrays(instance), instance.reach
    origins, m = len(arrays.origin_position), instance.m
    count = min(count, m)
    of_task = _nearest_by_position(arrays.task_position, arrays.task_position, count)
    if origins * m <= TABLE_LIMIT:
        table = np.empty((origins, m))
        if reach.is_plain:
            fill_table(arrays, table)
        else:
            table[:] = np.where(reach.mask, reach.distance, np.inf)
        cost = table if reach.cost_is_distance else np.where(reach.mask, reach.cost, np.inf)
        arrays = arrays._replace(distance=table, cost=cost)
        row, of_origin = np.arange(origins), _nearest_by_table(table, count)
    elif origins <= MAX_ROWS:
        row, of_origin = np.arange(origins), _nearest_by_position(arrays.origin_position, arrays.task_position, count)
    else:
        nearest = _nearest_by_position(arrays.origin_position, arrays.task_position, 1)[:, 0]
        row, of_origin = np.maximum(0, nearest), of_task
    return arrays, Candidates(row.astype(np.int32), of_origin, of_task)


def mean_candidate_cost(arrays: InstanceArrays, candidates: Candidates) -> float:
    """Return the mean cost from an origin to its candidates, over a sample; 1 if there is none.

    Costs are straight-line distances, unless there is a table of other costs.
    """
    rows = np.arange(0, len(arrays.origin_position), max(1, len(arrays.origin_position) // SAMPLE_SIZE))
    tasks = candidates.of_origin[candidates.row[rows]]
    with np.errstate(over="ignore", invalid="ignore"):
        step = arrays.origin_position[rows][:, None, :] - arrays.task_position[tasks]
        cost = np.sqrt((step * step).sum(axis=2))[tasks >= 0]
    if len(arrays.cost) and arrays.cost is not arrays.distance:
        cost = arrays.cost[rows[:, None], tasks][tasks >= 0]
    cost = cost[np.isfinite(cost) & (cost > 0)]
    return float(cost.mean()) if len(cost) else 1.0


def _nearest_by_table(table: FloatArray, count: int) -> Int32Array:
    """Return the nearest tasks of each origin, with ties broken at random; repeated if fewer are within reach.

    A row is filled with -1 only if no task is within reach, as draws of -1 are wasted.
    """
    shuffle = np.random.default_rng(0).permutation(table.shape[1])
    shuffled = table[:, shuffle]
    order = np.argpartition(shuffled, count - 1, axis=1)[:, :count]
    unreachable = np.take_along_axis(shuffled, order, axis=1) == np.inf
    within = np.where(unreachable, -1, shuffle[order])
    number = np.maximum(1, (~unreachable).sum(axis=1, keepdims=True))
    first = np.take_along_axis(within, np.argsort(unreachable, axis=1, kind="stable"), axis=1)
    return np.take_along_axis(first, np.arange(count) % number, axis=1).astype(np.int32)


def _nearest_by_position(position: FloatArray, task_position: FloatArray, count: int) -> Int32Array:
    """Return the nearest tasks of each position, -1 if it is unknown or there are too few tasks."""
    known, given = np.flatnonzero(~np.isnan(task_position[:, 0])), ~np.isnan(position[:, 0])
    found = np.full((len(position), count), -1, dtype=np.int32)
    if len(known) and given.any():
        _, index = KDTree(task_position[known]).query(position[given], k=np.arange(1, count + 1))
        found[given] = np.append(known, -1)[np.minimum(index, len(known))]
    return found
