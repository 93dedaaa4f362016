"""One chain of exchanges: an instance laid out for the compiled loops, an aim, and the plan that is changed."""

import numpy as np
from scipy.spatial import KDTree

from alloc.allocators.heuristic.local_search.anneal import Near, anneal
from alloc.allocators.heuristic.local_search.instance_arrays import TABLE_LIMIT, Ground, Small, survey
from alloc.allocators.heuristic.local_search.kernels import fill_table, settle
from alloc.allocators.heuristic.local_search.plan import (
    BEST,
    CHANGED,
    CROWDED,
    FLOWN,
    SHORTS,
    Plan,
    Weights,
    lay_out,
    room_to_work,
)
from alloc.problems import IDLE, Allocation, Instance
from alloc.problems.instance import FloatArray

ROUNDING = 1e-12
"""Relative part of a need that is forgiven, for what sums of floats may be off."""

MOST_ROWS = 100_000
"""Origins up to which each has its own near tasks; beyond, those of its nearest task."""


class Chain:
    """A plan, an aim in hours, and what is needed to improve it.

    Parameters
    ----------
    instance : Instance
    seed : int
    near : int
        Candidates per origin and per task.
    """

    def __init__(self, instance: Instance, seed: int, near: int) -> None:
        self.instance = instance
        self.ground, self.near = measure(instance, near)
        self.scratch = room_to_work(seed)
        m, n = instance.m, instance.n
        state = np.random.default_rng(seed).integers(1, 2**63, 1, dtype=np.uint64)
        self.hours = 1.0
        self._served = np.ones(instance.m, dtype=bool)
        self._least_room = np.full(m + 1, min(n, max(16, 2 * n // m)), dtype=np.int64)
        self.plan = _empty_plan(n, m, state)
        largest = float(self.ground.ability.max())
        self.sums = largest if self.ground.whole else np.inf
        self.step = near_distance(self.ground, self.near)

    @property
    def short(self) -> int:
        """Number of tasks that lack something."""
        return int(self.plan.counter[SHORTS])

    def begin(self, allocation: Allocation, hours: float) -> None:
        """Go on from an allocation, and aim at a makespan."""
        idle = self.instance.m
        task = np.where(allocation.task_of_agent == IDLE, idle, allocation.task_of_agent).astype(np.int32)
        task[np.append(self.instance.workload == 0, False)[task]] = idle
        self._served = np.isin(np.arange(idle), task)
        self._place(task)
        self.aim(hours)

    def aim(self, hours: float) -> None:
        """Aim at another makespan with the same plan."""
        ground, need = self.ground, self.plan.need
        self.hours = hours
        with np.errstate(over="ignore"):
            exact = self.instance.workload / (hours * ground.unit) * (1 - ROUNDING)
        exact[~self._served] = 0.0
        need[:-1] = np.minimum(np.ceil(exact) if ground.whole else exact, 1e300)
        settle(ground, self.plan, hours)
        self.plan.figure[BEST] = np.inf
        self.plan.counter[CHANGED] = self.instance.n + 1  # nothing is kept yet

    def run(self, steps: int, weights: Weights, cooling: float) -> float:
        """Make exchanges; return the noise reached."""
        noise: float = anneal(self.ground, self.plan, self.scratch, self.near, self.hours, steps, weights, cooling)
        if self.plan.counter[CROWDED]:
            self._grow()
        return noise

    def refresh(self) -> None:
        """Work loads and distances out anew, against rounding that adds up."""
        settle(self.ground, self.plan, self.hours)

    @property
    def allocation(self) -> Allocation:
        """The plan as it is."""
        return _as_allocation(self.plan.task, self.instance.m)

    @property
    def best(self) -> Allocation | None:
        """The plan of least distance since the aim was set that lacks nothing, if any."""
        return _as_allocation(self.plan.best, self.instance.m) if self.best_distance < np.inf else None

    @property
    def best_distance(self) -> float:
        """Distance of `best`, ``inf`` for none."""
        return float(self.plan.figure[BEST])

    @property
    def distance(self) -> float:
        """Distance of the plan as it is."""
        return float(self.plan.figure[FLOWN])

    def longest(self) -> float:
        """Hours that the plan takes as it is, where travel takes no time."""
        work = self.plan.need[:-1] > 0
        with np.errstate(divide="ignore"):
            return float((self.instance.workload[work] / self.plan.load[:-1][work]).max() / self.ground.unit)

    def _place(self, task: Small) -> None:
        """Lay the groups out anew."""
        slot, begin, size, at = lay_out(task, self.instance.m + 1, self._least_room)
        self.plan.task[:] = task
        self.plan = self.plan._replace(slot=slot, begin=begin, size=size, at=at)

    def _grow(self) -> None:
        """Give full groups more room."""
        self.plan.counter[CROWDED] = 0
        room = np.diff(self.plan.begin)
        full = self.plan.size >= room
        self._least_room = np.where(full, np.minimum(2 * room, self.instance.n), room)
        self._place(self.plan.task.copy())


def _as_allocation(task: Small, idle: int) -> Allocation:
    return Allocation(np.where(task == idle, IDLE, task))


def _empty_plan(n: int, m: int, random: "np.ndarray[tuple[int], np.dtype[np.uint64]]") -> Plan:
    small = np.int32
    return Plan(
        task=np.full(n, m, dtype=small),
        slot=np.zeros(0, dtype=small),
        begin=np.zeros(m + 2, dtype=np.int64),
        size=np.zeros(m + 1, dtype=small),
        at=np.zeros(n, dtype=small),
        need=np.zeros(m + 1),
        load=np.zeros(m + 1),
        short=np.zeros(m, dtype=small),
        short_at=np.full(m, -1, dtype=small),
        best=np.full(n, m, dtype=small),
        journal=np.zeros(n, dtype=small),
        counter=np.zeros(3, dtype=np.int64),
        figure=np.zeros(2),
        random=random,
    )


def measure(instance: Instance, near: int) -> tuple[Ground, Near]:
    """Lay an instance out for the compiled loops, with `near` candidates per origin and task."""
    ground = survey(instance)
    origins, m = len(ground.place), instance.m
    near = min(near, m)
    of_task = _nearest_tasks(ground.goal, ground.goal, near)
    if origins * m <= TABLE_LIMIT:
        table = np.empty((origins, m))
        fill_table(ground, table)
        ground = ground._replace(table=table)
        row, of_origin = np.arange(origins), _nearest_in(table, near)
    elif origins <= MOST_ROWS:
        row, of_origin = np.arange(origins), _nearest_tasks(ground.place, ground.goal, near)
    else:
        row, of_origin = np.maximum(0, _nearest_tasks(ground.place, ground.goal, 1)[:, 0]), of_task
    return ground, Near(row.astype(np.int32), of_origin, of_task)


def _nearest_in(table: FloatArray, near: int) -> Small:
    """Return the nearest tasks of each origin, ties at random, -1 where fewer are in reach."""
    shuffle = np.random.default_rng(0).permutation(table.shape[1])
    shuffled = table[:, shuffle]
    order = np.argpartition(shuffled, near - 1, axis=1)[:, :near]
    out = np.take_along_axis(shuffled, order, axis=1) == np.inf
    return np.where(out, -1, shuffle[order]).astype(np.int32)


def _nearest_tasks(place: FloatArray, goal: FloatArray, near: int) -> Small:
    """Return the nearest tasks of each place, -1 where the place is unknown or there are too few."""
    known, here = np.flatnonzero(~np.isnan(goal[:, 0])), ~np.isnan(place[:, 0])
    found = np.full((len(place), near), -1, dtype=np.int32)
    if len(known) and here.any():
        _, index = KDTree(goal[known]).query(place[here], k=np.arange(1, near + 1))
        found[here] = np.append(known, -1)[np.minimum(index, len(known))]
    return found


def near_distance(ground: Ground, near: Near) -> float:
    """Return the mean distance from an origin to its near tasks, over a sample; 1 if there is none."""
    rows = np.arange(0, len(ground.place), max(1, len(ground.place) // 1000))
    tasks = near.of_origin[near.row[rows]]
    with np.errstate(over="ignore", invalid="ignore"):
        step = ground.place[rows][:, None, :] - ground.goal[tasks]
        distance = np.sqrt((step * step).sum(axis=2))[tasks >= 0] * ground.scale
    distance = distance[np.isfinite(distance) & (distance > 0)]
    return float(distance.mean()) if len(distance) else 1.0
