"""Narrow the energy from both sides: better plans by sharing out anew, better bounds by prices, in turn."""

import time
from collections.abc import Callable

import numpy as np

from alloc.allocators.exact.energy.lagrangian import Offer, Prices
from alloc.allocators.exact.energy.sharing import Shaking, Sharing
from alloc.allocators.exact.model import ROUNDING, Demand, Model
from alloc.allocators.parallel.pool import Pool
from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

GRID = 1000
"""Steps into which a need is divided where it is no small whole number."""

LARGEST_NEED = 5000
"""Whole needs up to this are left as they are."""

MOST_WORK = 100_000_000
"""Cells of all tables that a round of prices, or a descent over all pairs of tasks, may fill: some 0.1 s."""

MOST_TASKS = 2000
"""Tasks beyond which neither side is worth its memory."""

SLICE_S = 0.02
"""What walk and prices each may take in one go."""

REPEATABLE_SLICES, REPEATABLE_ROUNDS = 60, 10
"""Slices, and rounds in each, where runs must be repeatable."""


def compile_loops() -> None:
    """Compile all loops, so that no run waits for it."""
    plan = np.array([0, 1])
    walk = Sharing(plan, np.ones(2, dtype=int), np.ones((2, 2)), np.ones(2, dtype=int), np.zeros((2, 2)), 0)
    walk.descend()
    walk.walk(1, 0.0)
    one, two = np.ones(2, dtype=np.int64), np.array([0, 1])
    Prices(Offer(two, two, one, one, np.ones(2), one, one, one, one, None), np.zeros((2, 2))).ascend(1, 3.0)


class Narrowing:
    """Plans and bounds for the least energy by `model.at(limit)`, all tasks that `plan` serves being served.

    Parameters
    ----------
    instance : Instance
    model : Model
    demand : Demand
    plan : Allocation
        A plan that meets the demand.
    seed : int
    """

    def __init__(self, instance: Instance, model: Model, demand: Demand, plan: Allocation, seed: int) -> None:
        self._instance, self._model, self._demand = instance, model, demand
        apart = distances_apart(instance.task_position[model.tasks])
        self._order = np.lexsort((demand.kind, demand.goal))
        self._usable = np.zeros(0, dtype=bool)
        self._prices = None if demand.partial else self._priced(apart)
        self._walk = self._begin(plan, apart, seed)
        self._told = self._cost = float(_flown(instance, plan))
        self._rounds = [1, 1]
        self._descended = self._walk is None

    @property
    def bound(self) -> float:
        """Distance that every plan needs, as far as proven."""
        return 0.0 if self._prices is None else min(self._prices.bound * (1 - ROUNDING), self._cost)

    @property
    def idle(self) -> bool:
        """Whether there is nothing that it can do."""
        return self._walk is None and self._prices is None

    @property
    def closed(self) -> bool:
        """Whether the best plan is proven."""
        return self._prices is not None and self._prices.bound >= self._cost * (1 - 1e-9)

    @property
    def settled(self) -> bool:
        """Whether bounds hardly rise any more."""
        return self._prices is None or self._prices.settled

    @property
    def keep(self) -> IntArray:
        """Which pairs of the demand a better plan may have, sorted."""
        if self._prices is None:
            return np.arange(len(self._demand.kind))
        return np.sort(self._order[self._usable][self._prices.kept])

    def run(self, cooled: float, pool: Pool | None) -> Allocation | None:
        """Work on both sides for some 20 ms each, at once if there is a `pool`; return a plan if a better one was met.

        Parameters
        ----------
        cooled : float
            How much of the time has passed, from 0 to 1.
        pool : Pool or None
        """
        if not self._descended:
            return self._descend()
        rising = None if pool is None else pool.submit(self._rise)
        if self._walk is not None:
            walk = self._walk
            self._timed(0, lambda rounds: walk.walk(rounds, cooled))
        if rising is None:
            self._rise()
        else:
            rising.result()
        return self._better()

    def repeat(self, slice_: int) -> Allocation | None:
        """Work on both sides as `run` does, by count and not by the clock."""
        if not self._descended:
            return self._descend()
        if self._walk is not None:
            self._walk.walk(REPEATABLE_ROUNDS, slice_ / REPEATABLE_SLICES)
        if self._prices is not None:
            self._prices.ascend(REPEATABLE_ROUNDS, self._cost)
        return self._better()

    def meet(self, cost: float) -> None:
        """Learn of a plan found elsewhere."""
        self._cost = min(self._cost, cost)

    def _descend(self) -> Allocation | None:
        """Come first, as prices aim at the cost of the plan at hand."""
        assert self._walk is not None
        self._descended = self._walk.descend()
        return self._better()

    def _rise(self) -> None:
        if self._prices is not None:
            prices, cost = self._prices, self._cost
            self._timed(1, lambda rounds: prices.ascend(rounds, cost))

    def _timed(self, side: int, work: Callable[[int], None]) -> None:
        """Do as many rounds as fit into a slice, by what the last ones took."""
        begin = time.monotonic()
        work(self._rounds[side])
        took = max(time.monotonic() - begin, 1e-5)
        self._rounds[side] = int(np.clip(self._rounds[side] * np.clip(SLICE_S / took, 0.25, 2.0), 1, 100_000))

    def _better(self) -> Allocation | None:
        """Return the walk's best plan if it is news."""
        if self._walk is None or self._walk.cost >= self._told * (1 - 1e-12):
            return None
        self._told = self._walk.cost
        tasks = np.append(self._model.tasks, IDLE)
        return Allocation(tasks[self._walk.best])

    def _priced(self, apart: FloatArray) -> Prices | None:
        offer = self._offer()
        cells = np.maximum(offer.need, offer.enough)[offer.goal].sum()
        return Prices(offer, apart) if cells <= MOST_WORK else None

    def _offer(self) -> Offer:
        """Round the demand to small whole numbers such that every plan that meets it meets these."""
        demand, order = self._demand, self._order
        kind, goal, need = demand.kind[order], demand.goal[order], demand.need
        tight = demand.spare < demand.ability.max()
        if demand.whole and need.max() <= LARGEST_NEED:
            ability = demand.ability.astype(np.int64)
            weight = ability[kind] if tight else demand.weight[order].astype(np.int64)
            enough = need + demand.spare if tight else np.full(len(need), -1)
            self._usable = weight <= enough[goal] if tight else np.ones(len(kind), dtype=bool)
        else:
            weight = np.ceil(demand.weight[order] / need[goal] * (GRID * (1 - ROUNDING))).astype(np.int64)
            ability, tight, need, enough = None, False, np.full(len(need), GRID), np.full(len(need), -1)
            self._usable = np.ones(len(kind), dtype=bool)
        offer = Offer(
            kind=kind.astype(np.int64),
            goal=goal.astype(np.int64),
            weight=weight,
            copies=demand.most[order].astype(np.int64),
            cost=self._model.distance[self._model.pairs_at(demand)][order],
            need=need.astype(np.int64),
            enough=enough.astype(np.int64),
            count=demand.count.astype(np.int64),
            least=demand.least_used.astype(np.int64) if tight else np.zeros(len(demand.count), dtype=np.int64),
            ability=ability,
        )
        return offer.only(self._usable)

    def _begin(self, plan: Allocation, apart: FloatArray, seed: int) -> Sharing | None:
        """Place the walk at `plan`; None where it is not made for the instance."""
        instance, model, demand = self._instance, self._model, self._demand
        if model.delay is not None:
            return None
        column = np.full(instance.m + 1, len(model.tasks))
        column[model.tasks] = np.arange(len(model.tasks))
        task = column[plan.task_of_agent]
        distance = np.where(model.classes.mask, model.classes.distance, np.inf)[:, model.tasks]
        ability = model.classes.ability
        if demand.whole and demand.need.max() <= LARGEST_NEED:
            weight, need = demand.ability.astype(np.int64), demand.need.astype(np.int64)
        else:
            work = model.work / demand.time * (1 - ROUNDING)
            scale = LARGEST_NEED / work.max()
            weight, need = np.floor(ability * scale).astype(np.int64), np.ceil(work * scale).astype(np.int64)
        served = np.bincount(task, minlength=len(need) + 1)[:-1] > 0
        need, distance = np.where(served, need, 0), np.where(served, distance, np.inf)
        sweep = (
            len(need) * min(len(need), Shaking().partners) / 2 * (instance.n + 2 * instance.n / len(need) * need.max())
        )
        kinds = model.classes.class_of_agent
        return Sharing(task, weight[kinds], distance[kinds], need, apart, seed) if sweep <= MOST_WORK else None


def distances_apart(place: FloatArray) -> FloatArray:
    """Return how far any two places are apart, large numbers being scaled, shape (t, t)."""
    known = np.nan_to_num(place)
    known = known / max(1.0, float(np.abs(known).max(initial=0.0)))
    return np.asarray(np.sqrt(((known[:, None] - known[None]) ** 2).sum(axis=2)))


def _flown(instance: Instance, plan: Allocation) -> float:
    sent = np.flatnonzero(plan.task_of_agent != IDLE)
    return float(instance.reach.distance_of(sent, plan.task_of_agent[sent]).sum())
