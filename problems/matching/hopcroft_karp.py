"""Maximum bipartite matching with bounded running time on any graph, unlike SciPy's, which may take minutes."""

from collections.abc import Iterator

import numpy as np

from alloc.problems.instance import IntArray
from alloc.problems.matching.clock import Clock, unlimited
from alloc.problems.vocabulary import IDLE

CHECK_EVERY = 16
"""Number of rows between two checks of the clock."""

UNSEEN = -1
"""Level of a row that no alternating path has reached, or that no longer leads to a free column."""


def match(first: IntArray, column: IntArray, time_left: Clock = unlimited) -> tuple[IntArray, bool]:
    """Return a maximum matching as `largest_matching` does, but computed from the smaller side.

    Parameters
    ----------
    first : ndarray of int, shape (rows + 1,)
    column : ndarray of int, shape (pairs,)
    time_left : callable
        Returns the seconds left; by default no limit.
    """
    rows, columns = len(first) - 1, int(column.max(initial=-1)) + 1
    matched = np.full(rows, IDLE, dtype=np.intp)
    if rows <= columns:
        return largest_matching(first, column, matched, time_left)
    order = np.argsort(column, kind="stable")
    begin = np.searchsorted(column[order], np.arange(columns + 1))
    row = np.repeat(np.arange(rows), np.diff(first))[order]
    found, is_largest = largest_matching(begin, row, np.full(columns, IDLE, dtype=np.intp), time_left)
    matched[found[found != IDLE]] = np.flatnonzero(found != IDLE)
    return matched, is_largest


def largest_matching(first: IntArray, column: IntArray, start: IntArray, time_left: Clock) -> tuple[IntArray, bool]:
    """Return a maximum matching, the column of each row or `IDLE`, and whether it is known to be maximum.

    It may be smaller if time runs out. By phases of shortest augmenting paths (Hopcroft and Karp 1973,
    doi:10.1137/0202019), in O(pairs * sqrt(rows)) time.

    Parameters
    ----------
    first : ndarray of int, shape (rows + 1,)
    column : ndarray of int, shape (pairs,)
        The columns of row i are ``column[first[i]:first[i + 1]]``.
    start : ndarray of int, shape (rows,)
        Matching to start from, `IDLE` for rows without a column.
    time_left : callable
        Returns the seconds left.
    """
    matching = _Matching(first, column, start, time_left)
    while is_larger := matching.find_levels():
        if not matching.augment_all():
            break
    return np.array(matching.held, dtype=np.intp), not is_larger


class _Matching:
    """A matching, and the level of each row: its distance from an unmatched row on alternating paths."""

    def __init__(self, first: IntArray, column: IntArray, start: IntArray, time_left: Clock) -> None:
        self.first, self.column, self.time_left = first.tolist(), column, time_left
        self.owner = [IDLE] * (int(column.max(initial=0)) + 1)
        self.held: list[int] = start.tolist()
        self.level: list[int] = []
        for row, held in enumerate(self.held):
            if held != IDLE:
                self.owner[held] = row
        for row in [row for row, held in enumerate(self.held) if held == IDLE]:
            for one in self._columns(row):
                if self.owner[one] == IDLE:
                    self.owner[one], self.held[row] = row, one
                    break

    def _columns(self, row: int) -> list[int]:
        columns: list[int] = self.column[self.first[row] : self.first[row + 1]].tolist()
        return columns

    def _in_time(self, rows: list[int]) -> Iterator[int]:
        """Yield the rows until time runs out."""
        for count, row in enumerate(rows):
            if count % CHECK_EVERY == 0 and self.time_left() <= 0:
                return
            yield row

    def find_levels(self) -> bool:
        """Compute the levels of rows by breadth-first search; return False if there is no augmenting path."""
        self.level = [0 if held == IDLE else UNSEEN for held in self.held]
        front = [row for row, level in enumerate(self.level) if level == 0]
        depth, found = 0, False
        while front and not found:
            depth, behind = depth + 1, []
            for row in self._in_time(front):
                for column in self._columns(row):
                    owner = self.owner[column]
                    if owner == IDLE:
                        found = True
                    elif self.level[owner] == UNSEEN:
                        self.level[owner] = depth
                        behind.append(owner)
            front = behind
            found = found or self.time_left() <= 0  # unknown
        return found

    def augment_all(self) -> bool:
        """Augment along a maximal set of shortest paths; return False if time runs out."""
        for row in self._in_time([row for row, held in enumerate(self.held) if held == IDLE]):
            self._augment(row)
        return self.time_left() > 0

    def _augment(self, root: int) -> None:
        """Match `root` along a path of increasing levels, if one is left in this phase."""
        path, options, steps = [root], [iter(self._columns(root))], 0
        taken: list[int] = []
        while path:
            column = next(options[-1], None)
            if column is None:
                self.level[path.pop()] = UNSEEN
                options.pop()
                if taken:
                    taken.pop()
                continue
            owner = self.owner[column]
            if owner == IDLE:
                for row, one in zip(path, [*taken, column], strict=True):
                    self.held[row], self.owner[one], self.level[row] = one, row, UNSEEN
                return
            if self.level[owner] == self.level[path[-1]] + 1:
                steps += 1
                if steps % CHECK_EVERY == 0 and self.time_left() <= 0:
                    return
                taken.append(column)
                path.append(owner)
                options.append(iter(self._columns(owner)))
