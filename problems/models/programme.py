"""The model of the paper, (4) and (5), as an integer programme with names.

Variables
    x_AGENT__TASK   whether the agent does the task, e_ij of (5)
    n_AGENT__TASK   how many agents of the class of AGENT, its first one, do the task: those of a class have the same
                    ability and can take the same tasks
    p_AGENT__TASK   the same for classes of agents that also start at the same place, for energy and arrival times
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
"""Name of the variable BOUND / T."""


@dataclass(frozen=True, eq=False)
class Programme:
    """Data of the model: classes of agents, tasks with workload, and useful pairs of both.

    Attributes
    ----------
    instance : Instance
    grouping : Grouping
    groups : AgentClasses
        Classes whose agents the variables count.
    tasks : ndarray of int, shape (t,)
        Tasks with workload, one row each.
    kind, row : ndarray of int, shape (p,)
        Class, and index into `tasks`, of each pair.
    rate : ndarray, shape (p,)
        Mean work per hour of an agent of the pair until T.
    energy : ndarray, shape (p,), or None
        Energy to be minimised; None if there is no objective, or the makespan is minimised.
    hours : float
        T, or BOUND if the makespan is minimised.
    is_free : bool
        Whether the makespan is minimised; y is then the last variable.
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
        """Power of two by which abilities and workloads are scaled; 1 for ordinary magnitudes."""
        return scale_to_one(float(np.median(self.instance.ability)))

    @cached_property
    def need(self) -> FloatArray:
        """Least ability that each task needs by `hours`, times `scale`; shape (t,)."""
        return self.instance.workload[self.tasks] / self.hours * self.scale

    @cached_property
    def used(self) -> IntArray:
        """Classes that have a variable; their rows follow those of the tasks."""
        return np.unique(self.kind)

    @cached_property
    def agent_names(self) -> list[str]:
        """Name of each agent in names of variables and rows."""
        return plain_names(self.instance.agent_ids, "agent")

    @cached_property
    def task_names(self) -> list[str]:
        """Name of each task in names of variables and rows."""
        return plain_names(self.instance.task_ids, "task")

    @cached_property
    def class_names(self) -> list[str]:
        """Name of each class, which is that of its first agent."""
        first = np.unique(self.groups.class_of_agent, return_index=True)[1]
        return [self.agent_names[agent] for agent in first.tolist()]

    def column_names(self) -> list[str]:
        """Return the names of the variables."""
        pairs = zip(self.kind.tolist(), self.tasks[self.row].tolist(), strict=True)
        names = [f"{self.grouping}_{self.class_names[k]}{SEPARATOR}{self.task_names[j]}" for k, j in pairs]
        return [*names, RATIO] if self.is_free else names

    def row_names(self) -> list[str]:
        """Return the names of the rows, first of tasks, then of agents or classes."""
        kind = "agent" if self.grouping is Grouping.AGENT else "class"
        return [
            *(f"task_{self.task_names[j]}" for j in self.tasks.tolist()),
            *(f"{kind}_{self.class_names[k]}" for k in self.used.tolist()),
        ]

    def matrix(self) -> "csc_array":
        """Return the coefficients, with rows as in `row_names` and columns as in `column_names`."""
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
        Whether variables count the agents of a class, or there is one per agent.
    objective : Objective
        With ``makespan-energy``, energy is minimised at `makespan`.
    makespan : float, optional
        Deadline of all tasks, > 0; if None, it is minimised.

    Raises
    ------
    InputError
        If `makespan` is None, but energy is minimised or there are travel times.
    RefusedError
        If there is no work, a task cannot be served, or the model would be too large.
    """
    if objective not in OBJECTIVES:
        raise InputError(f"must be {' or '.join(OBJECTIVES)}", "objective")
    with_energy, travels = objective is Objective.MAKESPAN_ENERGY, instance.has_travel_time
    if makespan is None and (with_energy or travels):
        why = "energy is minimised at a makespan" if with_energy else "contributions of agents depend on their arrival"
        raise InputError(f"is required, as {why}; `alloc solve` finds one", "makespan")
    if not (instance.workload > 0).any():
        raise RefusedError("there is no work to do, so that there is no model")
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
    useful = rate > 0  # no variables for agents that arrive too late
    kind, row = kind[useful], row[useful]
    energy = instance.reach.energy_per_distance * groups.cost[kind, tasks[row]] if with_energy else None
    return Programme(instance, grouping, groups, tasks, kind, row, rate[useful], energy, hours, makespan is None)
