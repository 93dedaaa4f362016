"""Selection of the tasks with the most priority among tasks that compete for too few agents."""

import numpy as np

from alloc.problems.distances.neighbours import estimated_pairs
from alloc.problems.fields import BoolArray
from alloc.problems.instance import Instance, IntArray
from alloc.problems.matching.clock import GATHERED_PER_SECOND, Clock, share_of, unlimited
from alloc.problems.matching.hopcroft_karp import largest_matching
from alloc.problems.matching.pairs import sampled_pairs
from alloc.problems.matching.precedence import Precedence, of_first, urgent_first
from alloc.problems.vocabulary import IDLE

SAMPLE_SHARE, LONGEST_S = 0.1, 2.0
"""Share of the time for a sample of the pairs, if there are many, and its limit in seconds."""

MANY_PAIRS = 1_000_000
"""Number of all pairs beyond which a sample is tried first."""

MAX_PAIRS = 50_000_000
"""Maximum number of pairs that are collected."""


def most_priority(
    instance: Instance,
    agents: IntArray,
    tasks: IntArray,
    known: IntArray,
    time_left: Clock = unlimited,
    sampled: IntArray | None = None,
) -> tuple[Precedence, IntArray, bool]:
    """Return the matchings of all `agents` with one of `tasks` each that serve the most priority, and one of them.

    Sets of tasks that can be served together form a transversal matroid (Edmonds and Fulkerson 1965,
    doi:10.6028/jres.069B.016). Hence a set with the largest total priority contains as many as possible of the tasks
    with the highest priority, of those with the two highest priorities, and so on.

    Parameters
    ----------
    agents : ndarray of int, shape (k,)
    tasks : ndarray of int, shape (more than k,)
    known : ndarray of int, shape (k,)
        A task of each agent, without repetitions.
    time_left : callable
        Returns the seconds left; by default no limit.
    sampled : ndarray of int, shape (k,), optional
        Result of `sampled_matching`, if it has been called.

    Returns
    -------
    precedence : Precedence
    task_of_agent : ndarray of int, shape (k,)
    is_proven : bool
        Whether no matching serves more priority; False if time ran out.
    """
    start = np.full(len(agents), IDLE, dtype=np.intp) if sampled is None else sampled
    if sampled is None and len(agents) * len(tasks) > MANY_PAIRS:
        start = sampled_matching(instance, agents, tasks, time_left)
        if (start != IDLE).all():
            return of_first(instance, tasks, len(agents)), start, True
    in_time = share_of(0.8, time_left)
    pairs = _all_within_reach(instance, agents, tasks, share_of(0.5, in_time))
    found = None if pairs is None else _Groups(instance, len(agents), tasks, *pairs, in_time).found()
    return _completed(instance, start, known, time_left) if found is None else (*found, True)


def sampled_matching(instance: Instance, agents: IntArray, tasks: IntArray, time_left: Clock) -> IntArray:
    """Return a matching of the k agents with the k most urgent tasks from a sample of the pairs, `IDLE` for none.

    If all agents have a task, no matching serves more priority.
    """
    seconds = min(LONGEST_S, SAMPLE_SHARE * time_left())
    first = urgent_first(instance, tasks)[: len(agents)]
    pairs, _ = sampled_pairs(instance, agents, first, None, seconds, share_of(0.3, time_left))
    start = np.full(len(agents), IDLE, dtype=np.intp)
    return largest_matching(pairs.first, pairs.task, start, share_of(0.4, time_left))[0]


def _all_within_reach(
    instance: Instance, agents: IntArray, tasks: IntArray, time_left: Clock
) -> tuple[IntArray, IntArray] | None:
    """Return the row of the agent and the task of each pair within reach; None if there are too many."""
    reach, most = instance.reach, min(MAX_PAIRS, GATHERED_PER_SECOND * time_left())
    near = reach.neighbours if reach.has_table or estimated_pairs(reach) <= most else None
    if near is None:
        return None
    origin, wanted = reach.origin[agents], np.zeros(instance.m, dtype=np.bool_)
    wanted[tasks] = True
    length = near.first[origin + 1] - near.first[origin]
    if length.sum() > most:
        return None
    row, task = np.repeat(np.arange(len(agents)), length), values_of_rows(near.first, near.task.astype(np.intp), origin)
    return row[wanted[task]], task[wanted[task]]


def _completed(
    instance: Instance, start: IntArray, known: IntArray, time_left: Clock
) -> tuple[Precedence, IntArray, bool]:
    """Match the idle agents of `start` by means of `known`, so that no task of `start` is lost."""
    k = len(start)
    row, task = (
        np.concatenate([np.arange(k), np.flatnonzero(start != IDLE)]),
        np.concatenate([known, start[start != IDLE]]),
    )
    order = np.argsort(row, kind="stable")
    chosen, _ = largest_matching(np.searchsorted(row[order], np.arange(k + 1)), task[order], start, time_left)
    if (chosen == IDLE).any():
        chosen = known
    group, required = np.full(instance.m, IDLE, dtype=np.intp), np.zeros(instance.m, dtype=np.bool_)
    group[chosen], required[chosen] = 0, True
    return Precedence(np.zeros(k, dtype=np.intp), group, required), chosen, False


class _Groups:
    """Agents and tasks, recursively divided by whether the more urgent half of the tasks can be served.

    If it can, it is required. If not, the tasks that could replace each other as unserved ones, and all agents that can
    take one of them, form a separate part, from which no agent can be spared for less urgent tasks.
    """

    def __init__(
        self, instance: Instance, k: int, tasks: IntArray, row: IntArray, task: IntArray, time_left: Clock
    ) -> None:
        self.k, self.tasks, self.time_left, self.pairs = k, tasks, time_left, (row, task)
        order = np.argsort(task, kind="stable")
        self.first, self.row = np.searchsorted(task[order], np.arange(instance.m + 1)), row[order]
        self.rank = np.zeros(instance.m, dtype=np.intp)
        self.rank[tasks] = np.unique(-instance.priority[tasks], return_inverse=True)[1]
        self.holder = np.full(instance.m, IDLE, dtype=np.intp)  # the row of the agent of each required task
        self.group_of_agent = np.full(k, IDLE, dtype=np.intp)
        self.group_of_task = np.full(instance.m, IDLE, dtype=np.intp)
        self.required = np.zeros(instance.m, dtype=np.bool_)

    def found(self) -> tuple[Precedence, IntArray] | None:
        """Return the precedence and a matching; None if time runs out."""
        parts, number = [(np.arange(self.k), self.tasks[:0], self.tasks)], 0
        while parts:
            agents, required, optional = parts.pop()
            ranks = np.unique(self.rank[optional])
            if len(ranks) <= 1 or len(required) == len(agents):
                served = required if len(required) == len(agents) else np.concatenate([required, optional])
                self.group_of_agent[agents] = self.group_of_task[served] = number
                self.required[required] = True
                number += 1
                continue
            divided = self._divided(agents, required, optional, int(ranks[(len(ranks) - 1) // 2]))
            if divided is None:
                return None
            parts.extend(part for part in divided if len(part[0]))
        return self._completed()

    def _divided(
        self, agents: IntArray, required: IntArray, optional: IntArray, rank: int
    ) -> list[tuple[IntArray, IntArray, IntArray]] | None:
        """Divide a part, given by its agents, the tasks that they must serve, and those that they may serve."""
        urgent = optional[self.rank[optional] <= rank]
        later, tasks = optional[self.rank[optional] > rank], np.concatenate([required, urgent])
        self.holder[optional] = IDLE
        first, column = self._pairs_of(tasks, agents)
        held = self.holder[tasks]
        start = np.where(held == IDLE, IDLE, np.searchsorted(agents, held))
        matched, is_largest = largest_matching(first, column, start, self.time_left)
        if not is_largest:
            return None
        self.holder[tasks] = np.where(matched == IDLE, IDLE, agents[matched])
        rival, met = _rivals(first, column, matched, len(agents))
        split = len(required)
        return [
            (agents[met], required[rival[:split]], urgent[rival[split:]]),
            (agents[~met], tasks[~rival], later),
        ]

    def _pairs_of(self, tasks: IntArray, agents: IntArray) -> tuple[IntArray, IntArray]:
        """Return the pairs of tasks with agents as compressed rows of indices into `agents`, which is ascending."""
        row = values_of_rows(self.first, self.row, tasks)
        length = self.first[tasks + 1] - self.first[tasks]
        place = np.minimum(np.searchsorted(agents, row), len(agents) - 1)
        kept = agents[place] == row
        begin = np.concatenate([[0], np.cumsum(length)])
        return np.concatenate([[0], np.cumsum(kept)])[begin], place[kept]

    def _completed(self) -> tuple[Precedence, IntArray] | None:
        """Return the precedence, and a matching that extends the matching of the required tasks."""
        precedence = Precedence(self.group_of_agent, self.group_of_task, self.required)
        row, task = self.pairs
        kept = precedence.allows(row, task)
        row, task = row[kept], task[kept]
        start, required = np.full(self.k, IDLE, dtype=np.intp), np.flatnonzero(self.required)
        start[self.holder[required]] = required
        chosen, _ = largest_matching(np.searchsorted(row, np.arange(self.k + 1)), task, start, self.time_left)
        return None if (chosen == IDLE).any() else (precedence, chosen)


def _rivals(first: IntArray, column: IntArray, matched: IntArray, columns: int) -> tuple[BoolArray, BoolArray]:
    """Return the rows that could replace an unmatched one, and the columns that these rows can have."""
    rival, met = np.zeros(len(matched), dtype=np.bool_), np.zeros(columns, dtype=np.bool_)
    row_of, held = np.full(columns, IDLE, dtype=np.intp), np.flatnonzero(matched != IDLE)
    row_of[matched[held]] = held
    front = np.flatnonzero(matched == IDLE)
    while len(front):
        rival[front] = True
        able = np.unique(values_of_rows(first, column, front))
        able = able[~met[able]]
        met[able] = True
        front = row_of[able]
        front = front[~rival[front]]
    return rival, met


def values_of_rows(first: IntArray, values: IntArray, rows: IntArray) -> IntArray:
    """Return the concatenated values of some compressed rows."""
    length = first[rows + 1] - first[rows]
    offset = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    found: IntArray = values[np.repeat(first[rows], length) + offset]
    return found
