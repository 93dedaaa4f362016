"""A largest matching whose running time is bounded, whatever the graph; that of SciPy may take minutes."""

import numpy as np

from alloc.problems.instance import IntArray
from alloc.problems.matching.assignment import Pairs
from alloc.problems.matching.clock import Clock
from alloc.problems.vocabulary import IDLE

CHECK_EVERY = 16
"""Rows between two looks at the clock."""

UNSEEN = -1
"""The level of a row that no alternating path has reached."""


def largest_matching(first: IntArray, column: IntArray, start: IntArray, time_left: Clock) -> tuple[IntArray, bool]:
    """Return a column for each row of compressed pairs, `IDLE` for none, and whether as many rows as can be have one.

    Where time runs out, fewer may have one. By phases of shortest augmenting paths (Hopcroft and Karp 1973,
    doi:10.1137/0202019): O(pairs * sqrt(rows)) time.

    Parameters
    ----------
    first : ndarray of int, shape (rows + 1,)
    column : ndarray of int, shape (pairs,)
        The columns of row i are ``column[first[i]:first[i + 1]]``.
    start : ndarray of int, shape (rows,)
        A matching to begin with, `IDLE` where a row has no column.
    time_left : callable
        Seconds.
    """
    matching = _Matching(first, column, start)
    while is_larger := matching.find_levels():
        if not matching.augment_all(time_left):
            break
    return np.array(matching.held, dtype=np.intp), not is_larger


def match_in_time(pairs: Pairs, known: IntArray, time_left: Clock) -> IntArray | None:
    """Return a largest matching of agents with tasks, begun with what `pairs` holds of another; None if time runs out.

    Parameters
    ----------
    known : ndarray of int, shape (k,)
        The other matching.
    """
    row = pairs.row
    kept = pairs.task == known[row]
    start = np.full(len(known), IDLE, dtype=np.intp)
    start[row[kept]] = pairs.task[kept]
    found, is_largest = largest_matching(pairs.first, pairs.task, start, time_left)
    return found if is_largest else None


class _Matching:
    """A matching, and how far each row is from a row without a column."""

    def __init__(self, first: IntArray, column: IntArray, start: IntArray) -> None:
        self.first, self.column = first.tolist(), column.tolist()
        self.owner = [IDLE] * (int(column.max(initial=0)) + 1)
        self.held = start.tolist()
        for row, held in enumerate(self.held):
            if held != IDLE:
                self.owner[held] = row
        for row in [row for row, held in enumerate(self.held) if held == IDLE]:
            for place in range(self.first[row], self.first[row + 1]):
                if self.owner[self.column[place]] == IDLE:
                    self.owner[self.column[place]], self.held[row] = row, self.column[place]
                    break
        self.level: list[int] = []
        self.next: list[int] = []

    def find_levels(self) -> bool:
        """Set the level of each row on a shortest augmenting path; return whether there is such a path."""
        self.level = [0 if held == IDLE else UNSEEN for held in self.held]
        self.next = self.first[:-1]
        front = [row for row, level in enumerate(self.level) if level == 0]
        depth, found = 0, False
        while front and not found:
            depth, behind = depth + 1, []
            for row in front:
                for column in self.column[self.first[row] : self.first[row + 1]]:
                    owner = self.owner[column]
                    if owner == IDLE:
                        found = True
                    elif self.level[owner] == UNSEEN:
                        self.level[owner] = depth
                        behind.append(owner)
            front = behind
        return found

    def augment_all(self, time_left: Clock) -> bool:
        """Augment along as many paths of this phase as can be; False if time runs out."""
        for count, row in enumerate([row for row, held in enumerate(self.held) if held == IDLE]):
            if count % CHECK_EVERY == 0 and time_left() <= 0:
                return False
            self._augment(row)
        return True

    def _augment(self, root: int) -> None:
        """Give `root` a column along a path on which levels rise by one, if there is one left in this phase."""
        path = [root]
        while path:
            row = path[-1]
            if self.next[row] == self.first[row + 1]:
                path.pop()
                if path:
                    self.next[path[-1]] += 1
                continue
            owner = self.owner[self.column[self.next[row]]]
            if owner == IDLE:
                for mover in path:
                    column = self.column[self.next[mover]]
                    self.held[mover], self.owner[column] = column, mover
                    self.next[mover] += 1
                return
            if self.level[owner] == self.level[row] + 1:
                path.append(owner)
            else:
                self.next[row] += 1
