"""The model of the paper, (4) and (5), as an integer programme with names.

Variables
    x_AGENT__TASK   whether the agent does the task, e_ij of (5)
    n_AGENT__TASK   how many agents of the class of AGENT, its first one, do the task: those of a class have the same
                    ability and can take the same tasks
    p_AGENT__TASK   the same where those of a class also start at the same place, which counts for energy and arrival
    y               BOUND / T, where BOUND is a lower bound on the makespan T, so that y is at most 1

Without a makespan, y is maximised, which minimises T = max_j h_j / W_j:

    (task_j)    sum_i w_i x_ij >= (h_j / BOUND) y           for each task with workload
    (agent_i)   sum_j x_ij <= 1, or the size of the class

At a makespan T coefficients may depend on the travel times d_ij / v_i, and the energy may be minimised:

    (task_j)    sum_i w_i max(0, 1 - d_ij / (v_i T)) x_ij >= h_j / T

References
----------
Fang et al. (2025), equations (4), (5) and (19), doi:10.20944/preprints202502.0192.v1.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from alloc.problems.bounds import makespan_lower_bound, scale_to_one
from alloc.problems.classes import AgentClasses
from alloc.problems.errors import InputError, RefusedError
from alloc.problems.evaluation import last_equal
from alloc.problems.instance import FloatArray, Instance, IntArray
from alloc.problems.matching.unservable import fewest_unserved
from alloc.problems.models.grouping import Grouping, grouped
from alloc.problems.models.names import SEPARATOR, plain_names
from alloc.problems.vocabulary import OBJECTIVES, Objective

if TYPE_CHECKING:
    from scipy.sparse import csc_array

RATIO = "y"
"""The variable BOUND / T."""


@dataclass(frozen=True, eq=False)
class Programme:
    """The data of the model: classes of agents, the tasks with work, and the pairs of both that are of use.

    Attributes
    ----------
    instance : Instance
    grouping : Grouping
    groups : AgentClasses
        The classes whose agents the variables count.
    tasks : ndarray of int, shape (t,)
        Tasks with workload, one row each.
    kind, row : ndarray of int, shape (p,)
        Class, and index into `tasks`, of each pair.
    rate : ndarray, shape (p,)
        Mean work per hour of an agent of the pair until T.
    energy : ndarray, shape (p,), or None
        What is minimised; None where it is nothing, or the makespan.
    hours : float
        T, or BOUND where the makespan is minimised.
    is_free : bool
        Whether the makespan is minimised: then y is the last variable.
    """

    instance: Instance
    grouping: Grouping
    groups: AgentClasses
    tasks: IntArray
    kind: IntArray
    row: IntArray
    rate: FloatArray
    energy: FloatArray | None
    hours: float
    is_free: bool

    @cached_property
    def scale(self) -> float:
        """Power of two by which abilities and workloads are multiplied: 1 where they are of an ordinary order."""
        return scale_to_one(float(np.median(self.instance.ability)))

    @cached_property
    def need(self) -> FloatArray:
        """Least ability on each task at `hours`, times `scale`; shape (t,)."""
        return self.instance.workload[self.tasks] / self.hours * self.scale

    @cached_property
    def used(self) -> IntArray:
        """The classes that have a variable, one row each, after those of the tasks."""
        return np.unique(self.kind)

    @cached_property
    def agent_names(self) -> list[str]:
        """Name of each agent in those of variables and rows."""
        return plain_names(self.instance.agent_ids, "agent")

    @cached_property
    def task_names(self) -> list[str]:
        """Name of each task in those of variables and rows."""
        return plain_names(self.instance.task_ids, "task")

    @cached_property
    def class_names(self) -> list[str]:
        """Name of each class: that of its first agent."""
        first = np.unique(self.groups.class_of_agent, return_index=True)[1]
        return [self.agent_names[agent] for agent in first.tolist()]

    def column_names(self) -> list[str]:
        """Return the names of the variables."""
        pairs = zip(self.kind.tolist(), self.tasks[self.row].tolist(), strict=True)
        names = [f"{self.grouping}_{self.class_names[k]}{SEPARATOR}{self.task_names[j]}" for k, j in pairs]
        return [*names, RATIO] if self.is_free else names

    def row_names(self) -> list[str]:
        """Return the names of the rows, of tasks first, then of agents or classes."""
        kind = "agent" if self.grouping is Grouping.AGENT else "class"
        return [
            *(f"task_{self.task_names[j]}" for j in self.tasks.tolist()),
            *(f"{kind}_{self.class_names[k]}" for k in self.used.tolist()),
        ]

    def matrix(self) -> "csc_array":
        """Return the coefficients, a row for each of `row_names`, a column for each of `column_names`."""
        from scipy.sparse import block_array, csc_array

        columns, v = np.arange(len(self.kind)), len(self.kind)
        work = csc_array((self.rate * self.scale, (self.row, columns)), shape=(len(self.tasks), v))
        of_class = np.searchsorted(self.used, self.kind)
        agents = csc_array((np.ones(v), (of_class, columns)), shape=(len(self.used), v))
        ratio = csc_array(-self.need[:, None])
        return csc_array(block_array([[work, ratio], [agents, None]] if self.is_free else [[work], [agents]]))


def build_programme(
    instance: Instance, *, by_class: bool, objective: Objective, makespan: float | None = None
) -> Programme:
    """Return the integer programme of `instance`.

    Parameters
    ----------
    instance : Instance
    by_class : bool
        Whether variables count the agents of a class; else each agent has its own.
    objective : Objective
        With ``makespan-energy``, the energy is minimised at `makespan`.
    makespan : float, optional
        Time by which every task must be done, > 0; minimised where it is None.

    Raises
    ------
    InputError
        If `makespan` is None with energy or with travel times.
    RefusedError
        If there is no work, not every task can be served, or the model would be too large.
    """
    if objective not in OBJECTIVES:
        raise InputError(f"must be {' or '.join(OBJECTIVES)}", "objective")
    with_energy, travels = objective is Objective.MAKESPAN_ENERGY, instance.has_travel_time
    if makespan is None and (with_energy or travels):
        why = "the least energy is that at a makespan" if with_energy else "what an agent adds depends on its arrival"
        raise InputError(f"is needed, as {why}; `alloc solve` finds one", "makespan")
    if not (instance.workload > 0).any():
        raise RefusedError("there is no work to do, and so no model")
    if fewest_unserved(instance):
        raise RefusedError("not every task can be served, so that the model has no solution; `alloc solve` says why")
    by_place = Grouping.PLACE if with_energy or travels else Grouping.ABILITY
    grouping = by_place if by_class else Grouping.AGENT
    groups, tasks = grouped(instance, grouping), np.flatnonzero(instance.workload > 0)
    kind, row = np.nonzero(groups.mask[:, tasks])
    hours = makespan_lower_bound(instance) if makespan is None else last_equal(makespan)
    rate = groups.ability[kind]
    if travels:
        with np.errstate(over="ignore"):
            travel = groups.distance[kind, tasks[row]] / groups.speed[kind]
            rate = rate * np.maximum(0.0, 1 - travel / hours)
    useful = rate > 0  # who arrives too late has no variable
    kind, row = kind[useful], row[useful]
    energy = instance.reach.energy_per_distance * groups.cost[kind, tasks[row]] if with_energy else None
    return Programme(instance, grouping, groups, tasks, kind, row, rate[useful], energy, hours, makespan is None)
