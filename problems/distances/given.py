"""User-given distances, for roads, corridors or no-fly zones."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Literal, cast

import numpy as np

from alloc.problems.arguments import listed, shown
from alloc.problems.distances.metric import Floats
from alloc.problems.distances.origins import entries
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import BoolArray, IntArray, ReadOnly, numbers

Missing = Literal["metric", "unreachable"]

MISSING = ("metric", "unreachable")
"""Treatment of pairs without a given distance: the metric, or unreachable."""


@dataclass(frozen=True, eq=False)
class DistanceTable(ReadOnly):
    """Given distances between tasks and agents' starts, bases or other tasks; symmetric unless both ways are given.

    Attributes
    ----------
    n, m : int
        Number of agents and tasks of the instance.
    source, target : ndarray of int, shape (k,)
        Start and end node of each flight: agent i is node i, task j is n + j, base k is n + m + k. Distances given
        for the task where an agent starts also apply to the agent.
    distance : ndarray, shape (k,)
    missing : {"metric", "unreachable"}
        Treatment of other pairs.
    bases : int
        Number of bases of the instance.
    """

    n: int
    m: int
    source: IntArray
    target: IntArray
    distance: Floats
    missing: Missing
    bases: int = 0

    @property
    def size(self) -> int:
        """Number of agents, tasks and bases."""
        return self.n + self.m + self.bases

    @classmethod
    def of(
        cls,
        rows: Iterable[tuple[str, str, float]],
        agent_ids: Sequence[str],
        task_ids: Sequence[str],
        missing: str = "metric",
        base_ids: Sequence[str] = (),
    ) -> "DistanceTable":
        """Build a table from rows.

        Parameters
        ----------
        rows : iterable of (str, str, float)
            Id of an agent, a task or a base, id of another, and the distance from the first to the second, >= 0.
        agent_ids, task_ids, base_ids : sequence of str
        missing : {"metric", "unreachable"}

        Raises
        ------
        InputError
            If an id is unknown or ambiguous, a pair is given twice, or neither of a pair is a task.
        """
        entries = [_row(entry, number) for number, entry in enumerate(listed(rows, "distances", "rows"))]
        source, target = [entry[0] for entry in entries], [entry[1] for entry in entries]
        distance = numbers([entry[2] for entry in entries], "distances") if entries else np.zeros(0)
        return cls.from_columns(source, target, distance, agent_ids, task_ids, missing=missing, base_ids=base_ids)

    @classmethod
    def from_columns(
        cls,
        source: Sequence[str],
        target: Sequence[str],
        distance: Floats,
        agent_ids: Sequence[str],
        task_ids: Sequence[str],
        *,
        missing: str = "metric",
        base_ids: Sequence[str] = (),
    ) -> "DistanceTable":
        """Build a table from columns; fast enough for millions of rows.

        Parameters
        ----------
        source, target : sequence of str
            Ids of agents, tasks and bases.
        distance : ndarray, shape (k,)
        agent_ids, task_ids, base_ids : sequence of str
        missing : {"metric", "unreachable"}

        Raises
        ------
        InputError
            As `of` does.
        """
        if missing not in MISSING:
            raise InputError(f"must be {' or '.join(map(repr, MISSING))}, got {shown(missing)}", "distances.missing")
        nodes = _nodes(agent_ids, task_ids, base_ids)
        table = cls(
            len(agent_ids),
            len(task_ids),
            _numbered(source, nodes, 0, "agent, task or base" if base_ids else "agent or task"),
            _numbered(target, nodes, 1, "agent, task or base" if base_ids else "agent or task"),
            np.array(distance, dtype=np.float64),
            cast("Missing", missing),
            len(base_ids),
        )
        table.check()
        for array in (table.source, table.target, table.distance):
            array.setflags(write=False)
        return table

    @classmethod
    def fitting(
        cls,
        given: "DistanceTable | Iterable[tuple[str, str, float]]",
        agent_ids: Sequence[str],
        task_ids: Sequence[str],
        base_ids: Sequence[str] = (),
    ) -> "DistanceTable":
        """Return `given`, a table or rows, as a table for an instance with these ids."""
        if not isinstance(given, DistanceTable):
            return cls.of(given, agent_ids, task_ids, base_ids=base_ids)
        if (given.n, given.m) != (len(agent_ids), len(task_ids)):
            raise InputError(f"is for {given.n} agents and {given.m} tasks", "distances")
        if given.bases > len(base_ids):
            raise InputError(f"is for {given.bases} bases", "distances")
        return replace(given, bases=len(base_ids))  # a table without rows of bases fits any number of bases

    def check(self) -> None:
        """Raise `InputError` for the first row that breaks a rule."""
        for wrong, rule in (
            (~(np.isfinite(self.distance) & (self.distance >= 0)), "must have a distance that is a finite number >= 0"),
            (
                ~(self._is_task(self.source) | self._is_task(self.target)),
                f"joins two agents{' or bases' if self.bases else ''}; give an agent and a task, or two tasks"
                f"{', or a base and a task' if self.bases else ''}",
            ),
        ):
            if wrong.any():
                raise InputError(rule, f"distances.rows[{int(np.argmax(wrong))}]")
        key = self.source * self.size + self.target
        order = np.argsort(key, kind="stable")
        twice = key[order][1:] == key[order][:-1]
        if twice.any():
            row = order[int(np.argmax(twice)) + 1]
            raise InputError("gives a pair that an earlier row gives; keep one of them", f"distances.rows[{row}]")

    def _is_task(self, node: IntArray) -> BoolArray:
        return (node >= self.n) & (node < self.n + self.m)

    def with_rows_of_starts(self, agents: IntArray, start_task: IntArray) -> "DistanceTable":
        """Return the table in which some agents have their own copies of the rows of their start tasks.

        Parameters
        ----------
        agents, start_task : ndarray of int, shape (k,)
        """
        if not len(agents):
            return self
        size, begins = self.size, self.n + start_task
        known = np.concatenate([self.source * size + self.target, self.target * size + self.source])
        parts = [(self.source, self.target, self.distance)]
        for ends, others in ((self.source, self.target), (self.target, self.source)):
            row = np.flatnonzero(self._is_task(ends) & self._is_task(others))
            row = row[np.argsort(ends[row], kind="stable")]
            begin = np.searchsorted(ends[row], np.arange(size + 1))
            agent, entry = entries(begin, agents, begins)
            new = ~np.isin(agent * size + others[row[entry]], known)
            agent, entry = agent[new], row[entry[new]]
            pair = (agent, others[entry])
            parts.append((*(pair if ends is self.source else pair[::-1]), self.distance[entry]))
        source, target, distance = (np.concatenate([part[column] for part in parts]) for column in range(3))
        return replace(self, source=source, target=target, distance=distance)

    def restricted(self, agents: IntArray, tasks: IntArray) -> "DistanceTable":
        """Return the table of the given agents and tasks, renumbered in this order; agents may be repeated."""
        number = np.full(self.size, -1, dtype=np.intp)
        number[self.n + tasks] = len(agents) + np.arange(len(tasks))
        number[self.n + self.m :] = len(agents) + len(tasks) + np.arange(self.bases)
        fixed = (number[self.source] >= 0) & (number[self.target] >= 0)
        parts = [(number[self.source[fixed]], number[self.target[fixed]], self.distance[fixed])]
        for ends, others in ((self.source, self.target), (self.target, self.source)):
            row = np.flatnonzero((ends < self.n) & (number[others] >= 0))
            row = row[np.argsort(ends[row], kind="stable")]
            begin = np.searchsorted(ends[row], np.arange(self.n + 1))
            new, entry = entries(begin, np.arange(len(agents)), agents)
            entry = row[entry]
            pair = (new, number[others[entry]])
            parts.append((*(pair if ends is self.source else pair[::-1]), self.distance[entry]))
        source, target, distance = (np.concatenate([part[column] for part in parts]) for column in range(3))
        return DistanceTable(len(agents), len(tasks), source, target, distance, self.missing, self.bases)

    def with_more_tasks(self, count: int) -> "DistanceTable":
        """Return the table with `count` further tasks without given distances."""
        ends = (np.where(one < self.n + self.m, one, one + count) for one in (self.source, self.target))
        source, target = ends
        return replace(self, m=self.m + count, source=source, target=target)

    def with_bases_at(self, starts: Sequence[tuple[int, int]]) -> "DistanceTable":
        """Return the table with further bases at the starts of agents.

        Parameters
        ----------
        starts : sequence of (int, int)
            Index of the agent, and of the task where it starts, -1 for none. The base gets the distances of the agent
            and, for other tasks, those of the start task.
        """
        rows: dict[tuple[int, int], float] = {}
        for base, (agent, task) in enumerate(starts, start=self.size):
            for node in (agent, self.n + task) if task >= 0 else (agent,):
                new: dict[tuple[int, int], float] = {}
                for ends, others in ((self.source, self.target), (self.target, self.source)):
                    for row in np.flatnonzero((ends == node) & self._is_task(others)).tolist():
                        pair = base, int(others[row])
                        new[pair if ends is self.source else pair[::-1]] = float(self.distance[row])
                known = {sum(pair) - base for pair in rows if base in pair}  # tasks with a distance
                rows |= {pair: length for pair, length in new.items() if sum(pair) - base not in known}
            if task >= 0:  # the base is at this task
                rows.setdefault((base, self.n + task), 0.0)
        ends = np.array(list(rows), dtype=np.intp).reshape(-1, 2)
        return replace(
            self,
            source=np.append(self.source, ends[:, 0]),
            target=np.append(self.target, ends[:, 1]),
            distance=np.append(self.distance, np.array(list(rows.values()))),
            bases=self.bases + len(starts),
        )

    def to_tasks(self) -> tuple[IntArray, IntArray, Floats, Floats]:
        """Return node, task, distance there and distance back of all given pairs, sorted by node and task."""
        size = self.size
        key, back = self.source * size + self.target, self.target * size + self.source
        keys = np.concatenate([key, back])
        values = np.concatenate([self.distance, self.distance])
        keys, first = np.unique(keys, return_index=True)  # a row takes precedence over the reverse of another
        values = values[first]
        node, goal = np.divmod(keys, size)
        reverse = values[np.searchsorted(keys, goal * size + node)] if len(keys) else values
        chosen = self._is_task(goal)
        return node[chosen], goal[chosen] - self.n, values[chosen], reverse[chosen]


Row = tuple[str, str, float]


def _row(entry: object, number: int) -> Row:
    if isinstance(entry, Sequence) and not isinstance(entry, str) and len(entry) == 3:
        source, target, distance = entry
        if isinstance(source, str) and isinstance(target, str):
            return source, target, distance
    raise InputError(f"must be [from, to, distance] with two ids, got {shown(entry)}", f"distances.rows[{number}]")


AMBIGUOUS, UNKNOWN = -1, -2
"""Node numbers for ambiguous ids, such as those of both an agent and a task, and for unknown ids."""


def _nodes(agent_ids: Sequence[str], task_ids: Sequence[str], base_ids: Sequence[str]) -> dict[str, int]:
    """Return the node of each id."""
    nodes = {name: index for index, name in enumerate(agent_ids)}
    for index, name in enumerate((*task_ids, *base_ids), start=len(agent_ids)):
        nodes[name] = AMBIGUOUS if name in nodes else index
    return nodes


def _numbered(names: Sequence[str], nodes: Mapping[str, int], column: int, kinds: str) -> IntArray:
    """Return the nodes of the ids in a column of the rows."""
    found = np.array(list(map(nodes.get, names, repeat(UNKNOWN))), dtype=np.intp)
    wrong = found < 0
    if wrong.any():
        row = int(np.argmax(wrong))
        name, place = names[row], f"distances.rows[{row}][{column}]"
        if found[row] == AMBIGUOUS:
            two = "an agent and of a task" if "base" not in kinds else "two of the agents, tasks and bases"
            raise InputError(f"{name!r} is the id of {two}; give them different ids", place)
        raise InputError(f"there is no {kinds} {name!r}{nearest(name, tuple(nodes))}", place)
    return found
