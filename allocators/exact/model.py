"""The exact model at a fixed makespan T: linear in the number of agents per class and task.

An agent of class k does ability_k * max(0, T - distance_kj / speed_k) on task j until T. Task j is done in time if that
sums to its workload over its group, so a plan with makespan T or less is an integer point x of

    sum_k weight_kj x_kj >= need_j for each task j,   sum_j x_kj <= count_k for each class k.

Travel times change the weights alone. Weights are capped at the need, which keeps the integer points and cuts off
fractional ones. Where abilities are multiples of a unit, needs are rounded up to it, and then nothing may be wasted
beyond what is to spare: that no task gets more, and that no more agents stay idle, helps solvers a lot on
the paper's scenarios, where nothing is to spare at the optimum.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from alloc.problems import AgentClasses, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

FEW_PAIRS = 200
"""Pairs of class and task that a solver does away with at once, so that nothing need be tried before."""

ROUNDING = 1e-12
"""Relative slack on needs, so that rounding in the last digits never makes a plan look too slow."""


@dataclass(frozen=True, eq=False)
class Demand:
    """What a plan must do by the time T; one entry per pair of class and task that is of use.

    Attributes
    ----------
    time : float
        T in hours.
    kind, goal : ndarray of int, shape (p,)
        Class, and row in `need`, of each pair.
    weight : ndarray, shape (p,)
        What one agent of the class adds to the task, at most its need.
    most : ndarray of int, shape (p,)
        Agents of the class that the task could use.
    need : ndarray, shape (t,)
        What each task with workload needs.
    count : ndarray of int, shape (k,)
        Agents in each class.
    serve : int
        How many of the tasks must be served: all, t, unless too few agents can reach them.
    whole : bool
        Whether weights and needs are integers.
    spare : float
        Ability beyond the sum of all needs, in their unit; ``inf`` where that says nothing.
    ability : ndarray, shape (k,)
        Ability of each class, in the same unit.
    """

    time: float
    kind: IntArray
    goal: IntArray
    weight: FloatArray
    most: IntArray
    need: FloatArray
    count: IntArray
    serve: int
    whole: bool
    spare: float
    ability: FloatArray

    @property
    def enough(self) -> FloatArray:
        """What no task can get more of, as the others would lack it, shape (t,)."""
        return self.need + self.spare

    @property
    def least_used(self) -> IntArray:
        """How many of each class must work, as otherwise the rest would lack something, shape (k,)."""
        if np.isinf(self.spare):
            return np.zeros_like(self.count)
        useful = np.bincount(self.kind, minlength=len(self.count)) > 0
        return np.where(useful, np.maximum(0, self.count - np.floor(self.spare / self.ability)), 0).astype(np.intp)

    @property
    def partial(self) -> bool:
        """Whether some tasks may stay unserved."""
        return self.serve < len(self.need)

    @property
    def hopeless(self) -> bool:
        """Whether all abilities together are too few, or too many tasks lack what they need even if all come."""
        if self.spare < 0:
            return True
        all_come = np.bincount(self.goal, weights=self.weight * self.most, minlength=len(self.need))
        return int((all_come >= self.need * (1 - 1e-9)).sum()) < self.serve


@dataclass(frozen=True, eq=False)
class Model:
    """Who can do what, ready to be asked for the demand at any T.

    Attributes
    ----------
    classes : AgentClasses
    tasks : ndarray of int, shape (t,)
        The tasks with workload; the others need nobody.
    work : ndarray, shape (t,)
        Their workloads.
    kind, goal : ndarray of int, shape (p,)
        Class, and index into `tasks`, of each pair within reach.
    delay : ndarray, shape (p,), or None
        Hours until an agent of the class arrives; None where travel takes no time.
    unit : float or None
        All abilities are multiples of it; None if no such unit is found, or travel takes time.
    serve : int
        How many of the tasks must be served.
    """

    classes: AgentClasses
    tasks: IntArray
    work: FloatArray
    kind: IntArray
    goal: IntArray
    delay: FloatArray | None
    unit: float | None
    serve: int

    @classmethod
    def build(cls, instance: Instance, classes: AgentClasses, serve: int) -> "Model":
        """Collect the pairs of class and task with workload."""
        tasks = np.flatnonzero(instance.workload > 0)
        kind, goal = np.nonzero(classes.mask[:, tasks])
        with np.errstate(over="ignore"):
            delay = classes.distance[kind, tasks[goal]] / classes.speed[kind] if instance.has_travel_time else None
        unit = None if instance.has_travel_time else _common_unit(classes.ability, classes.count)
        return cls(classes, tasks, instance.workload[tasks], kind, goal, delay, unit, serve)

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each pair, shape (p,)."""
        return self.classes.distance[self.kind, self.tasks[self.goal]]

    def at(self, time: float) -> Demand:
        """Return the demand at T = `time` hours, > 0."""
        ability, spare = self.classes.ability, np.inf
        if self.unit is None:
            need = np.full(len(self.work), 1 - ROUNDING)
            weight = np.minimum(1.0, self._rate(time) * (time / self.work[self.goal]))
        else:
            need, ability = self._units_needed(time), np.round(self.classes.ability / self.unit)
            weight = np.minimum(ability[self.kind], need[self.goal])
            if self.serve == len(need):
                useful = np.bincount(self.kind, minlength=self.classes.size) > 0
                spare = float(ability @ (self.classes.count * useful) - need.sum())
        with np.errstate(divide="ignore"):
            enough = np.ceil(np.where(weight > 0, need[self.goal] / weight, 0.0) * (1 - ROUNDING))
        most = np.minimum(self.classes.count[self.kind], enough).astype(np.intp)
        used = most > 0
        return Demand(
            time=time,
            kind=self.kind[used],
            goal=self.goal[used],
            weight=weight[used],
            most=most[used],
            need=need,
            count=self.classes.count,
            serve=self.serve,
            whole=self.unit is not None,
            spare=spare,
            ability=ability,
        )

    def pairs_at(self, demand: Demand) -> IntArray:
        """Return which of the model's pairs are those of `demand`."""
        columns = len(self.tasks)
        return np.searchsorted(self.kind * columns + self.goal, demand.kind * columns + demand.goal)

    def shares(self, time: float) -> FloatArray:
        """Return the part of each task that one agent of each class does by `time`, shape (k, t), at most 1."""
        share = np.zeros((self.classes.size, len(self.tasks)))
        share[self.kind, self.goal] = np.minimum(1.0, self._rate(time) * (time / self.work[self.goal]))
        return share

    def uncapped(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return what one agent of each class adds to each task, shape (k, t), and what each needs, shape (t,)."""
        able = np.zeros((self.classes.size, len(self.tasks)))
        if self.unit is None:
            able[self.kind, self.goal] = self._rate(time)
            return able, self.work / time * (1 - ROUNDING)
        able[self.kind, self.goal] = np.round(self.classes.ability / self.unit)[self.kind]
        return able, self._units_needed(time)

    def after(self, time: float) -> float:
        """Return a lower bound on the makespan of every plan that is slower than `time`.

        Where abilities are multiples of a unit, makespans are workloads over multiples of it, with gaps between them.
        """
        if self.unit is None:
            return time
        need = self._units_needed(time)
        if not (need > 1).any():
            return time
        return max(time, float((self.work[need > 1] / (need[need > 1] - 1)).min() / self.unit * (1 - ROUNDING)))

    def least_alike(self, time: float) -> float:
        """Return the least T at which the tasks need the same as at `time`, or `time` where that is not known."""
        if self.unit is None:
            return time
        return min(time, float((self.work / self._units_needed(time)).max() / self.unit))

    def allocation(self, demand: Demand, counts: IntArray) -> Allocation:
        """Turn numbers of agents per pair of `demand`, shape (p,), into an allocation."""
        table = np.zeros(self.classes.mask.shape, dtype=np.intp)
        table[demand.kind, self.tasks[demand.goal]] = counts
        return self.classes.spread(table)

    def counts(self, demand: Demand, allocation: Allocation) -> IntArray:
        """Return the numbers of agents per pair of `demand`; those who are of no use there are left out."""
        table = self.classes.tally(allocation)
        return np.minimum(table[demand.kind, self.tasks[demand.goal]], demand.most)

    def _rate(self, time: float) -> FloatArray:
        """Mean work per hour until `time` of one agent of each pair."""
        rate = self.classes.ability[self.kind]
        if self.delay is None:
            return rate
        with np.errstate(over="ignore"):  # what takes for ever brings nothing
            return rate * np.maximum(0.0, 1 - self.delay / time)

    def _units_needed(self, time: float) -> FloatArray:
        assert self.unit is not None
        return np.ceil(self.work / (time * self.unit) * (1 - ROUNDING))


def _common_unit(ability: FloatArray, count: IntArray) -> float | None:
    """Return the largest unit of which all abilities are multiples, if they have few decimals."""
    for decimals in range(7):
        scaled = ability * 10.0**decimals
        if scaled @ count > 2**40:
            return None
        rounded = np.round(scaled)
        if (np.abs(scaled - rounded) <= 1e-13 * scaled).all():
            return float(np.gcd.reduce(rounded.astype(np.int64))) / 10.0**decimals
    return None
