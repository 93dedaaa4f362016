"""Origins: groups of agents with the same place, range, battery and list of tasks."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


def group_rows(columns: Iterable[NDArray[np.float64]]) -> tuple[Indices, Indices]:
    """Group equal rows; return the first row of each group, and the group of each row; NaN equals NaN, 0.0 equals -0.0.

    Groups are sorted lexicographically by the columns. Takes O(n log n) time per column that is needed to distinguish
    the rows.
    """
    kind, kinds = np.zeros(0, dtype=np.intp), 1
    for column in columns:
        if not len(kind):
            kind = np.zeros(len(column), dtype=np.intp)
        if kinds == len(column):
            break
        if (column == column[0]).all() or np.isnan(column).all():
            continue
        values, number = np.unique(column, return_inverse=True)
        if kinds > 1:
            values, number = np.unique(kind * len(values) + number, return_inverse=True)
        kind, kinds = number.astype(np.intp, copy=False), len(values)
    first = np.empty(kinds, dtype=np.intp)
    first[kind[::-1]] = np.arange(len(kind) - 1, -1, -1)
    return first, kind


def number_lists(
    lists: Sequence[NDArray[np.intp] | None] | None, n: int
) -> tuple[Indices, tuple[NDArray[np.intp], ...]]:
    """Return the number of each agent's list, -1 if it may do all tasks, and the distinct lists."""
    if lists is None:
        return np.full(n, -1, dtype=np.intp), ()
    numbers: dict[bytes, int] = {}
    distinct: list[NDArray[np.intp]] = []
    number = np.full(n, -1, dtype=np.intp)
    for agent, tasks in enumerate(lists):
        if tasks is not None:
            number[agent] = numbers.setdefault(tasks.tobytes(), len(distinct))
            if number[agent] == len(distinct):
                distinct.append(tasks)
    return number, tuple(distinct)


def list_keys(lists: Sequence[NDArray[np.intp]], m: int) -> Indices:
    """Return the keys list * m + task of all entries of all lists, ascending, followed by a sentinel."""
    return np.concatenate([*(number * m + tasks for number, tasks in enumerate(lists)), [len(lists) * m]])


def entries(begin: Indices, origins: Indices, nodes: Indices) -> tuple[Indices, Indices]:
    """Return row, as in `origins`, and index of all entries of the compressed rows `nodes` with offsets `begin`."""
    length = begin[nodes + 1] - begin[nodes]
    total = int(length.sum())
    shift = np.repeat(begin[nodes] - (np.cumsum(length) - length), length)
    return np.repeat(origins, length), np.arange(total) + shift
