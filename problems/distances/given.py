"""Distances that the user gives: roads, corridors, no-fly zones."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Literal, cast

import numpy as np

from alloc.problems.arguments import listed, shown
from alloc.problems.distances.metric import Floats
from alloc.problems.distances.origins import entries
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import IntArray, ReadOnly, numbers

Missing = Literal["metric", "unreachable"]

MISSING = ("metric", "unreachable")
"""What holds for pairs that a table leaves out: the distance by the metric, or that nobody can go there."""


@dataclass(frozen=True, eq=False)
class DistanceTable(ReadOnly):
    """Distances between agents' starts and tasks, as far as they are given; both directions alike unless both are.

    Attributes
    ----------
    n, m : int
        Agents and tasks of the instance.
    source, target : ndarray of int, shape (k,)
        Where each flight begins and ends: agent i as i, task j as n + j. What is given for the task where an agent
        starts holds for the agent, too.
    distance : ndarray, shape (k,)
    missing : {"metric", "unreachable"}
        What holds for pairs that are left out.
    """

    n: int
    m: int
    source: IntArray
    target: IntArray
    distance: Floats
    missing: Missing

    @classmethod
    def of(
        cls,
        rows: Iterable[tuple[str, str, float]],
        agent_ids: Sequence[str],
        task_ids: Sequence[str],
        missing: str = "metric",
    ) -> "DistanceTable":
        """Return the table of some rows.

        Parameters
        ----------
        rows : iterable of (str, str, float)
            Id of an agent or a task, id of another, and the distance from the one to the other, >= 0.
        agent_ids, task_ids : sequence of str
        missing : {"metric", "unreachable"}

        Raises
        ------
        InputError
            If an id is unknown or stands for an agent and a task, a pair is given twice, or two agents are paired.
        """
        entries = [_row(entry, number) for number, entry in enumerate(listed(rows, "distances", "rows"))]
        source, target = [entry[0] for entry in entries], [entry[1] for entry in entries]
        distance = numbers([entry[2] for entry in entries], "distances") if entries else np.zeros(0)
        return cls.from_columns(source, target, distance, agent_ids, task_ids, missing)

    @classmethod
    def from_columns(
        cls,
        source: Sequence[str],
        target: Sequence[str],
        distance: Floats,
        agent_ids: Sequence[str],
        task_ids: Sequence[str],
        missing: str = "metric",
    ) -> "DistanceTable":
        """Return the table of some rows that are given by columns; takes millions of them in seconds.

        Parameters
        ----------
        source, target : sequence of str
            Ids of agents and tasks.
        distance : ndarray, shape (k,)
        agent_ids, task_ids : sequence of str
        missing : {"metric", "unreachable"}

        Raises
        ------
        InputError
            As `of` does.
        """
        if missing not in MISSING:
            raise InputError(f"must be {' or '.join(map(repr, MISSING))}, got {shown(missing)}", "distances.missing")
        nodes = _nodes(agent_ids, task_ids)
        table = cls(
            len(agent_ids),
            len(task_ids),
            _numbered(source, nodes, 0),
            _numbered(target, nodes, 1),
            np.array(distance, dtype=np.float64),
            cast("Missing", missing),
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
    ) -> "DistanceTable":
        """Return a table that is given, or that of the rows that are given, for an instance with these ids."""
        if not isinstance(given, DistanceTable):
            return cls.of(given, agent_ids, task_ids)
        if (given.n, given.m) != (len(agent_ids), len(task_ids)):
            raise InputError(f"is for {given.n} agents and {given.m} tasks", "distances")
        return given

    def check(self) -> None:
        """Raise `InputError` for the first row that breaks a rule."""
        for wrong, rule in (
            (~(np.isfinite(self.distance) & (self.distance >= 0)), "must have a distance that is a finite number >= 0"),
            (
                (self.source < self.n) & (self.target < self.n),
                "joins two agents; give an agent and a task, or two tasks",
            ),
        ):
            if wrong.any():
                raise InputError(rule, f"distances.rows[{int(np.argmax(wrong))}]")
        key = self.source * (self.n + self.m) + self.target
        order = np.argsort(key, kind="stable")
        twice = key[order][1:] == key[order][:-1]
        if twice.any():
            row = order[int(np.argmax(twice)) + 1]
            raise InputError("gives a pair that an earlier row gives; keep one of them", f"distances.rows[{row}]")

    def with_rows_of_starts(self, agents: IntArray, start_task: IntArray) -> "DistanceTable":
        """Return the table in which some agents have for their own what is given for the task where they start.

        Parameters
        ----------
        agents, start_task : ndarray of int, shape (k,)
        """
        if not len(agents):
            return self
        size, begins = self.n + self.m, self.n + start_task
        known = np.concatenate([self.source * size + self.target, self.target * size + self.source])
        parts = [(self.source, self.target, self.distance)]
        for ends, others in ((self.source, self.target), (self.target, self.source)):
            row = np.flatnonzero((ends >= self.n) & (others >= self.n))
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
        """Return what the table says of some agents and tasks, numbered anew in this order; agents may be repeated."""
        number = np.full(self.n + self.m, -1, dtype=np.intp)
        number[self.n + tasks] = len(agents) + np.arange(len(tasks))
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
        return DistanceTable(len(agents), len(tasks), source, target, distance, self.missing)

    def to_tasks(self) -> tuple[IntArray, IntArray, Floats, Floats]:
        """Return node, task, distance there and distance back for all known pairs, in order of node and task."""
        size = self.n + self.m
        key, back = self.source * size + self.target, self.target * size + self.source
        keys = np.concatenate([key, back])
        values = np.concatenate([self.distance, self.distance])
        keys, first = np.unique(keys, return_index=True)  # a row itself comes before the reverse of another
        values = values[first]
        node, goal = np.divmod(keys, size)
        reverse = values[np.searchsorted(keys, goal * size + node)] if len(keys) else values
        chosen = goal >= self.n
        return node[chosen], goal[chosen] - self.n, values[chosen], reverse[chosen]


Row = tuple[str, str, float]


def _row(entry: object, number: int) -> Row:
    if isinstance(entry, Sequence) and not isinstance(entry, str) and len(entry) == 3:
        source, target, distance = entry
        if isinstance(source, str) and isinstance(target, str):
            return source, target, distance
    raise InputError(f"must be [from, to, distance] with two ids, got {shown(entry)}", f"distances.rows[{number}]")


AMBIGUOUS, UNKNOWN = -1, -2
"""What stands in for the node of an id that an agent and a task have, and of one that there is not."""


def _nodes(agent_ids: Sequence[str], task_ids: Sequence[str]) -> dict[str, int]:
    """Return the node of each id."""
    nodes = {name: index for index, name in enumerate(agent_ids)}
    for index, name in enumerate(task_ids):
        nodes[name] = AMBIGUOUS if name in nodes else len(agent_ids) + index
    return nodes


def _numbered(names: Sequence[str], nodes: Mapping[str, int], column: int) -> IntArray:
    """Return the nodes of some ids, which stand in this column of the rows."""
    found = np.array(list(map(nodes.get, names, repeat(UNKNOWN))), dtype=np.intp)
    wrong = found < 0
    if wrong.any():
        row = int(np.argmax(wrong))
        name, place = names[row], f"distances.rows[{row}][{column}]"
        if found[row] == AMBIGUOUS:
            raise InputError(f"{name!r} is the id of an agent and of a task; give them different ids", place)
        raise InputError(f"there is no agent or task {name!r}{nearest(name, tuple(nodes))}", place)
    return found
