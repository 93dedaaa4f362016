"""A lower bound on the least energy, by prices on agents: Lagrangian relaxation, strengthened by clusters of tasks.

At prices on the agents of each class every task hires on its own, and its cheapest group is a knapsack (`patterns`).
What all groups cost, less what the agents on offer are worth, bounds the cost of every plan from below. A *cluster* of
tasks that are near each other adds that together, too, they must get whole agents: its members pay the cluster what
it pays for the agents as a whole, in a knapsack of its own. Prices follow a deflected subgradient.

A pair of class and task whose use would lift the bound above the cost of a plan at hand is dropped: no better plan has
it. With fewer pairs knapsacks and clusters shrink, and the bound rises.

References
----------
Geoffrion (1974), Lagrangean relaxation for integer programming, doi:10.1007/BFb0120690. Camerini, Fratta and Maffioli
(1975), On improving relaxation methods by modified gradient techniques, doi:10.1007/BFb0120697.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import linkage
from scipy.sparse import csr_array
from scipy.spatial.distance import squareform

from alloc.allocators.exact.makespan.patterns import WholeArray, cheapest_by_core, fill_table, read_group
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.instance import FloatArray

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Pace:
    """How prices change.

    Attributes
    ----------
    deflection : float
        Part of the last direction that goes on.
    patience : int
        Rounds without a better bound after which steps get shorter.
    decay : float
        How much shorter.
    """

    deflection: float
    patience: int
    decay: float


ALONE, CLUSTERED = Pace(0.75, 20, 0.7), Pace(0.95, 60, 0.8)
"""Before and after the clusters are added: more prices want longer memory and more patience."""

ENOUGH_STEP = 0.02
"""Steps shorter than this, where 1 is the step that would reach the plan's cost, are not worth many more."""

MOST_LINKS = 5_000_000
"""Clusters times pairs of class and task beyond which there are no clusters."""

SETTLED = 4
"""Shortenings after which the clusters are added."""


@compiled
def hire(
    first: WholeArray,
    kind: WholeArray,
    weight: WholeArray,
    copies: WholeArray,
    price: FloatArray,
    need: WholeArray,
    enough: WholeArray,
    group: WholeArray,
    excess: FloatArray,
) -> float:
    """Let every task, or cluster, hire its cheapest group; return what all cost.

    Parameters
    ----------
    first : ndarray of int, shape (t + 1,)
        Where the pairs of each task begin; the others but `need` and `enough` have one entry per pair.
    kind, weight, copies, price
        Class of the pair, what one agent adds, how many may come, and what one costs.
    need, enough : ndarray of int, shape (t,)
        Least and largest sum of weights; no limit where `enough` is below 0.
    group : ndarray of int
        Filled with the agents hired.
    excess : ndarray
        Filled with how much dearer the best group with an agent of the pair is, or less than that; may be empty.
    """
    total = 0.0
    for j in range(len(need)):
        a, b = first[j], first[j + 1]
        exact, top = enough[j] >= 0, max(need[j], enough[j])
        if exact and len(excess) == 0:
            paid, hired = cheapest_by_core(weight[a:b], price[a:b], copies[a:b], need[j], enough[j])
            for p in range(a, b):
                group[p] = hired[p - a]
            total += paid
            continue
        table = fill_table(weight[a:b], price[a:b], copies[a:b], top, exact)
        cost, best = table[0], need[j]
        for s in range(need[j], enough[j] + 1):
            if cost[s] < cost[best]:
                best = s
        total += cost[best]
        if not np.isfinite(cost[best]):
            return np.inf
        hired = read_group(table, b - a, best)
        for p in range(a, b):
            group[p] = hired[p - a]
        for p in range(a, b if len(excess) > 0 else a):
            with_it = np.inf
            if exact:
                for s in range(max(need[j], weight[p]), enough[j] + 1):
                    with_it = min(with_it, cost[s - weight[p]])
            else:
                with_it = cost[max(0, need[j] - weight[p])]
            excess[p] = with_it + price[p] - cost[best]
    return total


@dataclass(frozen=True, eq=False)
class Offer:
    """Agents per class, tasks, and the pairs of the two: what `Prices` bounds the least cost of.

    A plan gives each task j agents with weights that sum to ``need[j]`` at least and ``enough[j]`` at most, and has
    from `least` to `count` agents of each class at work.

    Attributes
    ----------
    kind, goal : ndarray of int, shape (p,)
        Class and task of each pair, in the order of tasks.
    weight : ndarray of int, shape (p,)
        What one agent adds to the task.
    copies : ndarray of int, shape (p,)
        Agents that the task could use.
    cost : ndarray, shape (p,)
    need, enough : ndarray of int, shape (t,)
        `enough` is -1 where there is no limit.
    count, least : ndarray of int, shape (k,)
    ability : ndarray of int, shape (k,), or None
        What one agent adds to any task, for the clusters; None where that depends on the task.
    """

    kind: WholeArray
    goal: WholeArray
    weight: WholeArray
    copies: WholeArray
    cost: FloatArray
    need: WholeArray
    enough: WholeArray
    count: WholeArray
    least: WholeArray
    ability: WholeArray | None

    def only(self, keep: Mask) -> "Offer":
        """Return the offer with some of its pairs."""
        return replace(
            self,
            kind=self.kind[keep],
            goal=self.goal[keep],
            weight=self.weight[keep],
            copies=self.copies[keep],
            cost=self.cost[keep],
        )

    @property
    def first(self) -> WholeArray:
        """Where the pairs of each task begin, shape (t + 1,)."""
        return np.searchsorted(self.goal, np.arange(len(self.need) + 1)).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Clusters:
    """Knapsacks of whole clusters: one entry for each cluster and class that may or may not work there.

    Attributes
    ----------
    hired : Offer
        The entries as pairs, clusters taking the place of tasks.
    link : csr_array, shape (pairs, entries)
        Which entries each pair of class and task counts for.
    """

    hired: Offer
    link: csr_array

    @classmethod
    def build(cls, offer: Offer, member: Mask) -> "Clusters":
        """Collect what the clusters, rows of `member`, shape (f, t), may hire."""
        assert offer.ability is not None
        inside = member[:, offer.goal]  # which pairs lie in each cluster
        kinds, spare = len(offer.count), offer.enough[0] - offer.need[0] if offer.enough[0] >= 0 else -1
        everywhere = np.bincount(offer.kind, minlength=kinds)
        need = member @ offer.need
        parts, rows, columns, entries = [], [], [], 0
        for f, mine in enumerate(inside):
            pairs = np.flatnonzero(mine)
            here = np.bincount(offer.kind[pairs], minlength=kinds)
            most = np.minimum(offer.count, np.bincount(offer.kind[pairs], offer.copies[pairs], kinds).astype(np.int64))
            settled = (here == everywhere) & (offer.least == offer.count) & (here > 0)
            need[f] -= (offer.ability * offer.count)[settled].sum()
            kind = np.flatnonzero((here > 0) & ~settled)
            place = np.full(kinds, -1)
            place[kind] = entries + np.arange(len(kind))
            used = pairs[place[offer.kind[pairs]] >= 0]
            rows.append(used)
            columns.append(place[offer.kind[used]])
            parts.append((kind, np.full(len(kind), f), most[kind]))
            entries += len(kind)
        kind, goal, most = (np.concatenate(part) for part in zip(*parts, strict=True))
        row, column = np.concatenate(rows), np.concatenate(columns)
        enough = need + spare if spare >= 0 else np.full(len(need), -1)
        hired = Offer(
            kind=kind,
            goal=goal,
            weight=offer.ability[kind],
            copies=most,
            cost=np.zeros(len(kind)),
            need=np.maximum(need, 0),
            enough=np.maximum(enough, -1),  # less than none is too little for any plan, which no limit is a bound on
            count=offer.count,
            least=offer.least,
            ability=None,
        )
        return cls(hired, csr_array((np.ones(len(row)), (row, column)), shape=(len(offer.kind), entries)))


class Prices:
    """An ascent on prices; ``bound`` is proven all the while.

    Parameters
    ----------
    offer : Offer
    apart : ndarray, shape (t, t)
        How far tasks are from each other.
    """

    def __init__(self, offer: Offer, apart: FloatArray) -> None:
        self.kept = np.ones(len(offer.kind), dtype=bool)
        self.bound, self._offer, self._first = 0.0, offer, offer.first
        self._member = None
        if offer.ability is not None and len(offer.need) > 3 and len(offer.need) * len(offer.kind) <= MOST_LINKS:
            self._member = _clusters(apart)
        self._clusters: Clusters | None = None
        self._price, self._paid = np.zeros(len(offer.count)), np.zeros(0)
        self._way = (np.zeros(len(offer.count)), np.zeros(0))
        self._all = np.zeros((0 if self._member is None else len(self._member), len(offer.count)))
        self._dropped = np.zeros(len(offer.kind), dtype=bool)
        self._step, self._since, self._stalled = 1.0, 0, 0

    @property
    def settled(self) -> bool:
        """Whether steps have become so short that the bound hardly rises any more."""
        return self._step < ENOUGH_STEP and (self._clusters is not None or self._member is None)

    def ascend(self, rounds: int, cost: float) -> None:
        """Change prices `rounds` times, given the cost of a plan at hand."""
        for _ in range(rounds):
            if self.bound >= cost * (1 - 1e-12):
                return
            self._round(cost)

    def _round(self, cost: float) -> None:
        offer, clusters, pace = self._offer, self._clusters, self._pace
        price = offer.cost + self._price[offer.kind]
        value = -float(np.where(self._price >= 0, offer.count, offer.least) @ self._price)
        if clusters is not None:
            price += clusters.link @ self._paid
            bought, _, extra = _hire(clusters.hired, -self._paid, compare=False)
            value += extra
        group, excess, total = _hire(offer, price)
        value += total
        if not np.isfinite(value):  # what is left has no plan, so none is better than the one at hand
            self.bound, self._step = (self.bound if self.kept.all() else np.inf), 0.0
            return
        self._dropped |= value + excess > cost * (1 + 1e-9)
        self._note(value)
        over = _excess_demand(np.bincount(offer.kind, group, len(offer.count)).astype(np.int64), offer, self._price)
        lent = clusters.link.T @ group - bought if clusters is not None else np.zeros(0)
        way, lending = over + pace.deflection * self._way[0], lent + pace.deflection * self._way[1]
        self._way = (way, lending)
        norm = float(way @ way + lending @ lending)
        if norm > 0:
            step = self._step * max(cost - value, 1e-6 * cost) / norm
            self._price, self._paid = self._price + step * way, self._paid + step * lending
            self._price = np.where(offer.least < offer.count, np.maximum(self._price, 0.0), self._price)
        join = self._clusters is None and self._stalled >= SETTLED and self._member is not None
        if join:
            self._step = 0.5
        if join or self._dropped.sum() > 0.1 * len(self._dropped):
            self._shrink(clusters=join or clusters is not None)

    @property
    def _pace(self) -> Pace:
        return ALONE if self._clusters is None else CLUSTERED

    def _note(self, value: float) -> None:
        """Keep the bound; shorten steps where they have led nowhere for long, and add the clusters after that."""
        self._since += 1
        if value > self.bound * (1 + 1e-7):
            self._since = 0
        self.bound = max(self.bound, value)
        pace = self._pace
        if self._since >= pace.patience:
            self._step, self._since, self._stalled = self._step * pace.decay, 0, self._stalled + 1

    def _shrink(self, *, clusters: bool) -> None:
        """Drop the pairs that no better plan has, and collect the clusters anew."""
        stay = ~self._dropped
        self.kept[self.kept] = stay
        self._offer = self._offer.only(stay)
        self._dropped = np.zeros(len(self._offer.kind), dtype=bool)
        if self._clusters is not None:
            self._all[self._clusters.hired.goal, self._clusters.hired.kind] = self._paid
        if clusters and self._member is not None:
            self._clusters = Clusters.build(self._offer, self._member)
            hired = self._clusters.hired
            self._paid = self._all[hired.goal, hired.kind]
            self._way = (self._way[0], np.zeros(len(hired.kind)))


def _excess_demand(used: WholeArray, offer: Offer, price: FloatArray) -> FloatArray:
    """How many more agents of each class are hired than are on offer at this price, a subgradient, shape (k,)."""
    many, few = used - offer.count, used - offer.least
    unpriced: FloatArray = np.maximum(many, 0.0) + np.minimum(few, 0.0)
    return np.where(price > 0, many, np.where(price < 0, few, unpriced))


def _hire(offer: Offer, price: FloatArray, *, compare: bool = True) -> tuple[WholeArray, FloatArray, float]:
    group, excess = np.zeros(len(price), dtype=np.int64), np.zeros(len(price) if compare else 0)
    total = hire(offer.first, offer.kind, offer.weight, offer.copies, price, offer.need, offer.enough, group, excess)
    return group, excess, total


def _clusters(apart: FloatArray) -> Mask:
    """Return small clusters of tasks by average linkage, the large ones being slow for what they add, shape (f, t)."""
    tasks = len(apart)
    member = np.vstack([np.eye(tasks, dtype=bool), np.zeros((tasks - 1, tasks), dtype=bool)])
    for row, (one, other, _, _) in enumerate(linkage(squareform(apart, checks=False), "average"), start=tasks):
        member[row] = member[int(one)] | member[int(other)]
    member = member[tasks:]
    small: Mask = member.sum(axis=1) <= max(4, tasks / 4)
    return np.asarray(member[small])
