"""One-to-one assignments of agents to tasks: bottleneck (least makespan) and linear sum (least cost)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from alloc.problems.fields import BoolArray
from alloc.problems.instance import FloatArray, IntArray
from alloc.problems.matching.clock import GATHERED_PER_SECOND, MATCHED_PER_SECOND, Clock
from alloc.problems.matching.hopcroft_karp import largest_matching
from alloc.problems.vocabulary import IDLE

SEARCH = 500_000_000
"""Agents times pairs for which the cheapest assignment usually takes a second, and at most ten."""


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of k agents with tasks, grouped by agent: those of agent i start at ``first[i]``.

    Attributes
    ----------
    first : ndarray of int, shape (k + 1,)
    task : ndarray of int, shape (p,)
    hours : ndarray, shape (p,)
        Completion time if the agent does the task alone.
    cost : ndarray, shape (p,)
        Cost of the flight, see `Reach.costs`.
    """

    first: IntArray
    task: IntArray
    hours: FloatArray
    cost: FloatArray

    def within(self, hours: float) -> "Pairs":
        """Return the pairs that take at most `hours`."""
        return self.chosen(self.hours <= hours)

    def chosen(self, which: NDArray[np.bool_]) -> "Pairs":
        """Return the pairs in the mask `which`, shape (p,)."""
        first = np.concatenate([[0], np.cumsum(which)])[self.first]
        return Pairs(first, self.task[which], self.hours[which], self.cost[which])

    @property
    def row(self) -> IntArray:
        """Agent of each pair."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))


def match_in_time(
    pairs: Pairs, known: IntArray, time_left: Clock, required: BoolArray | None = None
) -> IntArray | None:
    """Return a maximum matching of agents with tasks, starting from the pairs of `known`; None if time runs out.

    Parameters
    ----------
    known : ndarray of int, shape (k,)
        Matching to start from; pairs that are not in `pairs` are dropped.
    required : ndarray of bool, shape (m,), optional
        Tasks that must have an agent; if that is impossible, all agents are idle in the result.
    """
    row = pairs.row
    kept = pairs.task == known[row]
    start = np.full(len(known), IDLE, dtype=np.intp)
    start[row[kept]] = pairs.task[kept]
    if required is not None:
        covering = _covering(pairs, start, required, time_left)
        if covering is None or (required.any() and (covering == IDLE).all()):
            return covering
        start = covering  # augmenting paths from further agents keep matched tasks matched
    found, is_largest = largest_matching(pairs.first, pairs.task, start, time_left)
    return found if is_largest else None


def _covering(pairs: Pairs, start: IntArray, required: BoolArray, time_left: Clock) -> IntArray | None:
    """Return a matching of the required tasks, extended by `start`; idle if there is none, None if time runs out."""
    needed, is_needed = np.flatnonzero(required), required[pairs.task]
    place, row = np.searchsorted(needed, pairs.task[is_needed]), pairs.row[is_needed]
    order = np.argsort(place, kind="stable")
    held = np.full(len(needed), IDLE, dtype=np.intp)
    working = np.flatnonzero(start != IDLE)
    working = working[required[start[working]]]
    held[np.searchsorted(needed, start[working])] = working
    first = np.searchsorted(place[order], np.arange(len(needed) + 1))
    agent, is_largest = largest_matching(first, row[order], held, time_left)
    covering = np.full(len(start), IDLE, dtype=np.intp)
    if (agent == IDLE).any():
        return covering if is_largest else None
    optional = np.flatnonzero((start != IDLE) & ~required[start])
    covering[optional] = start[optional]
    covering[agent] = needed
    return covering


def bottleneck(
    pairs: Pairs, known: IntArray, latest: float, time_left: Clock, required: BoolArray | None = None
) -> tuple[IntArray, float]:
    """Return a bottleneck assignment, whose latest completion time is least, and a lower bound on that time.

    By bisection of the hours, with a matching for each; the bound is not tight if time runs out.

    Parameters
    ----------
    pairs : Pairs
        Pairs, including for each agent its task in `known`, or k pairs that are no slower.
    known : ndarray of int, shape (k,)
        An assignment to start from.
    latest : float
        Its latest completion time.
    time_left : callable
        Returns the seconds left.
    required : ndarray of bool, shape (m,), optional
        Tasks that must have an agent, as in `known`.
    """
    best, least = known, 0.0
    bound = float(np.minimum.reduceat(pairs.hours, pairs.first[:-1]).max())  # each agent with its fastest task
    low, high = bound, min(latest, float(pairs.hours.max()))
    while time_left() > len(pairs.task) / MATCHED_PER_SECOND:
        in_range = pairs.hours[(pairs.hours >= low) & (pairs.hours <= high)]
        if not len(in_range):
            break
        half = (len(in_range) - 1) // 2
        middle = float(np.partition(in_range, half)[half])
        within = pairs.within(middle)
        found = match_in_time(within, best, time_left, required)
        if found is None:
            break
        if (found == IDLE).any():
            low = float(np.nextafter(middle, np.inf))
            bound = max(bound, low)
        else:
            best, high, least = found, float(np.nextafter(middle, -np.inf)), middle
    else:
        return best, bound
    return best, max(bound, least)


def cheapest(
    pairs: Pairs, known: IntArray, cost: FloatArray, time_left: Clock, required: BoolArray | None = None
) -> IntArray:
    """Return the assignment with the least sum of `cost`, shape (p,) and >= 0, or `known` if time is too short.

    All `required` tasks, shape (m,), have an agent, as in `known`.

    By shortest augmenting paths (Jonker and Volgenant 1987, doi:10.1007/BF02278710), restricted to the cheapest pairs
    of each agent if all would take too long.
    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import min_weight_full_bipartite_matching

    k = len(known)
    work = min(1.0, 0.1 * time_left()) * SEARCH
    most = int(work // max(1, k * k))
    if most < 1 or not len(cost) or len(cost) > GATHERED_PER_SECOND * time_left():
        return known
    held = pairs.task == known[pairs.row]
    if len(cost) > most * k:
        if held.sum() < k:
            return known
        order = np.lexsort((cost, pairs.row))
        place = np.empty(len(cost), dtype=np.intp)
        place[order] = np.arange(len(cost)) - np.repeat(pairs.first[:-1], np.diff(pairs.first))
        few = held | (place < most)
        pairs, cost = pairs.chosen(few), cost[few]
    scale = float(cost.max())
    weight = 1.0 + (cost / scale if scale > 0 else cost)  # sparse matrices drop entries of weight 0
    if required is not None:
        weight += np.where(required[pairs.task], 0.0, 2.0 * k)  # required tasks take precedence over cost
    tasks, column = np.unique(pairs.task, return_inverse=True)
    graph = csr_matrix((weight, column, pairs.first), shape=(k, len(tasks)))
    chosen: IntArray = tasks[min_weight_full_bipartite_matching(graph)[1]]
    return chosen
