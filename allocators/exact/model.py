"""The model of the paper, (4) and (5), as integer programmes over classes of agents.

Sets and data
    k       classes of interchangeable agents: count_k agents, each with ability_k and speed_k
    j       tasks with workload_j > 0
    d_kj    distance of class k to task j; pairs (k, j) out of reach have no variable

Variables
    x_kj    agents of class k on task j, an integer >= 0
    T       makespan, hours

An agent of class k begins on task j after d_kj / speed_k hours, so that the completion time T_j of (4) is at most T if

    sum_k ability_k max(0, T - d_kj / speed_k) x_kj >= workload_j                                   for each task j,

and (5), minimise max_j T_j, asks for the least T at which there is a plan: integer x with these constraints and

    sum_j x_kj <= count_k                                                                          for each class k.

At a fixed T these are linear. With need_j = workload_j / T and weight_kj = ability_k max(0, 1 - d_kj / (speed_k T)):

    (work)      need_j <= sum_k weight_kj x_kj <= max_weight_j      for each task j
    (agents)    min_agents_k <= sum_j x_kj <= count_k               for each class k
    (energy)    minimise sum_kj d_kj x_kj                           in the second stage only

Needs and weights are in the unit of which all abilities are multiples, or, if there is none, in shares of the task's
workload. `Demand` holds these data at one T; `cpsat.formulate` and `milp.formulate` state the model for their solvers.
If not all tasks can be served, a binary y_j says whether task j is: need_j y_j replaces need_j, and
sum_j y_j >= min_served.

Two reformulations keep every integer plan and cut off fractional ones. Weights are capped at the need. If abilities are
multiples of a unit, needs are rounded up to it; then total ability minus total need is a known slack, which limits the
surplus of a task (max_weight_j = need_j + spare) and the number of idle agents (min_agents_k). In the paper's
scenarios, the slack is 0 at the optimum. Without a unit, max_weight_j is infinite and min_agents_k is 0.

References
----------
Fang et al. (2025), equations (4) and (5), doi:10.20944/preprints202502.0192.v1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from alloc.allocators.exact.demand import Demand
from alloc.problems import IDLE, AgentClasses, Allocation, Instance
from alloc.problems.instance import FloatArray, IntArray

FEW_PAIRS = 200
"""Number of pairs of class and task up to which the solver is so fast that it is called at once."""

ROUNDING = 1e-12
"""Relative slack on needs, so that no plan is excluded by rounding errors."""


@dataclass(frozen=True, eq=False)
class Model:
    """The model for any T: classes, tasks, and the pairs of both that are within reach.

    Attributes
    ----------
    classes : AgentClasses
    tasks : ndarray of int, shape (t,)
        The tasks with workload; the others need no agents.
    workload : ndarray, shape (t,)
        Their workloads.
    class_of_pair, task_of_pair : ndarray of int, shape (p,)
        Class, and index into `tasks`, of each pair within reach.
    travel_time : ndarray, shape (p,), or None
        Hours until an agent of the class arrives; None if travel takes no time.
    unit : float or None
        Unit of which all abilities are multiples; None if there is none, or travel takes time.
    min_served : int
        Number of tasks that must be served.
    """

    classes: AgentClasses
    tasks: IntArray
    workload: FloatArray
    class_of_pair: IntArray
    task_of_pair: IntArray
    travel_time: FloatArray | None
    unit: float | None
    min_served: int

    @classmethod
    def build(cls, instance: Instance, classes: AgentClasses, min_served: int) -> "Model":
        """Build the model of an instance and its classes of agents."""
        tasks = np.flatnonzero(instance.workload > 0)
        class_of_pair, task_of_pair = np.nonzero(classes.mask[:, tasks])
        travel_time = None
        if instance.has_travel_time:
            with np.errstate(over="ignore"):
                travel_time = classes.distance[class_of_pair, tasks[task_of_pair]] / classes.speed[class_of_pair]
        unit = None if instance.has_travel_time else _common_unit(classes.ability, classes.count)
        return cls(classes, tasks, instance.workload[tasks], class_of_pair, task_of_pair, travel_time, unit, min_served)

    @cached_property
    def cost(self) -> FloatArray:
        """Cost of each pair, in units of distance, shape (p,)."""
        return self.classes.cost[self.class_of_pair, self.tasks[self.task_of_pair]]

    def at(self, time: float) -> Demand:
        """Return the constraints at T = `time` hours, > 0."""
        ability, spare = self.classes.ability, np.inf
        if self.unit is None:
            need = np.full(len(self.workload), 1 - ROUNDING)
            weight = np.minimum(1.0, self._rate(time) * (time / self.workload[self.task_of_pair]))
        else:
            need, ability = self._units_needed(time), np.round(self.classes.ability / self.unit)
            weight = np.minimum(ability[self.class_of_pair], need[self.task_of_pair])
            if self.min_served == len(need):
                useful = np.bincount(self.class_of_pair, minlength=self.classes.size) > 0
                spare = float(ability @ (self.classes.count * useful) - need.sum())
        with np.errstate(divide="ignore"):
            sufficient = np.ceil(np.where(weight > 0, need[self.task_of_pair] / weight, 0.0) * (1 - ROUNDING))
        max_count = np.minimum(self.classes.count[self.class_of_pair], sufficient).astype(np.intp)
        used = max_count > 0
        return Demand(
            time=time,
            class_of_pair=self.class_of_pair[used],
            task_of_pair=self.task_of_pair[used],
            weight=weight[used],
            max_count=max_count[used],
            need=need,
            count=self.classes.count,
            min_served=self.min_served,
            integral=self.unit is not None,
            spare=spare,
            ability=ability,
        )

    def columns(self, plan: Allocation) -> IntArray:
        """Return each agent's task as an index into `tasks`, shape (n,); t for idle agents and other tasks."""
        tasks = np.append(self.tasks, np.iinfo(np.intp).max)
        column = np.searchsorted(tasks, plan.task_of_agent)
        return np.where(tasks[column] == plan.task_of_agent, column, len(self.tasks))

    def plan_of(self, column: IntArray) -> Allocation:
        """Return the plan given by the indices of `columns`; agents with index t are idle."""
        return Allocation(np.append(self.tasks, IDLE)[column])

    def pairs_at(self, demand: Demand) -> IntArray:
        """Return the indices of the pairs of `demand` among the model's pairs."""
        columns = len(self.tasks)
        pairs = self.class_of_pair * columns + self.task_of_pair
        return np.searchsorted(pairs, demand.class_of_pair * columns + demand.task_of_pair)

    def shares(self, time: float) -> FloatArray:
        """Return the share of each task that one agent of each class does by `time`, shape (k, t), at most 1."""
        share = np.zeros((self.classes.size, len(self.tasks)))
        done = self._rate(time) * (time / self.workload[self.task_of_pair])
        share[self.class_of_pair, self.task_of_pair] = np.minimum(1.0, done)
        return share

    def uncapped(self, time: float) -> tuple[FloatArray, FloatArray]:
        """Return weights without the cap at the need, shape (k, t), 0 out of reach, and needs, shape (t,)."""
        weight = np.zeros((self.classes.size, len(self.tasks)))
        if self.unit is None:
            weight[self.class_of_pair, self.task_of_pair] = self._rate(time)
            return weight, self.workload / time * (1 - ROUNDING)
        weight[self.class_of_pair, self.task_of_pair] = np.round(self.classes.ability / self.unit)[self.class_of_pair]
        return weight, self._units_needed(time)

    def next_makespan(self, time: float) -> float:
        """Return a lower bound on the makespan of every plan that is slower than `time`.

        If abilities are multiples of a unit, makespans are workloads divided by such multiples, with gaps between them.
        """
        if self.unit is None:
            return time
        need = self._units_needed(time)
        if not (need > 1).any():
            return time
        return max(time, float((self.workload[need > 1] / (need[need > 1] - 1)).min() / self.unit * (1 - ROUNDING)))

    def earliest_with_same_needs(self, time: float) -> float:
        """Return the least T at which the needs are the same as at `time`, or `time` if that is unknown."""
        if self.unit is None:
            return time
        return min(time, float((self.workload / self._units_needed(time)).max() / self.unit))

    def allocation(self, demand: Demand, counts: IntArray) -> Allocation:
        """Return the allocation with these numbers of agents per pair of `demand`, shape (p,)."""
        table = np.zeros(self.classes.mask.shape, dtype=np.intp)
        table[demand.class_of_pair, self.tasks[demand.task_of_pair]] = counts
        return self.classes.spread(table)

    def plan(self, table: IntArray) -> Allocation:
        """Return the allocation with these numbers of agents per class and task with workload, shape (k, t)."""
        full = np.zeros(self.classes.mask.shape, dtype=np.intp)
        full[:, self.tasks] = table
        return self.classes.spread(full)

    def counts(self, demand: Demand, allocation: Allocation) -> IntArray:
        """Return the numbers of agents per pair of `demand`; agents on other pairs are left out."""
        table = self.classes.tally(allocation)
        return np.minimum(table[demand.class_of_pair, self.tasks[demand.task_of_pair]], demand.max_count)

    def _rate(self, time: float) -> FloatArray:
        """Return the mean work per hour until `time` of one agent of each pair."""
        rate = self.classes.ability[self.class_of_pair]
        if self.travel_time is None:
            return rate
        with np.errstate(over="ignore"):  # a travel time of inf leaves a rate of 0
            return rate * np.maximum(0.0, 1 - self.travel_time / time)

    def _units_needed(self, time: float) -> FloatArray:
        assert self.unit is not None
        return np.ceil(self.workload / (time * self.unit) * (1 - ROUNDING))


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
