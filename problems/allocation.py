"""An allocation: at most one task for each agent (5)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import ReadOnly, indices
from alloc.problems.instance import Instance
from alloc.problems.text import counted
from alloc.problems.vocabulary import IDLE


@dataclass(frozen=True)
class CarriedOver:
    """Differences between an instance and the one that a plan was made for, by ids.

    Attributes
    ----------
    gone_agents, new_agents : tuple of str
        Agents that are only in the plan, and agents that are only in the instance.
    gone_tasks : tuple of str
        Tasks that are only in the plan.
    agents_without_task : tuple of str
        Agents of the instance whose task in the plan no longer exists.
    """

    gone_agents: tuple[str, ...] = ()
    gone_tasks: tuple[str, ...] = ()
    new_agents: tuple[str, ...] = ()
    agents_without_task: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return a summary in one line; empty if nothing has changed."""
        parts = [
            f"{counted(len(names), kind)} {'has' if len(names) == 1 else 'have'} gone"
            for kind, names in (("agent", self.gone_agents), ("task", self.gone_tasks))
            if names
        ]
        if self.new_agents:
            parts.append(f"{counted(len(self.new_agents), 'agent')} {'is' if len(self.new_agents) == 1 else 'are'} new")
        return ", ".join(parts)


@dataclass(frozen=True, eq=False)
class Allocation(ReadOnly):
    """The task of each agent.

    Parameters
    ----------
    task_of_agent : array_like of int, shape (n,)
        Task index of each agent, -1 for idle; stored as a read-only copy.
    """

    task_of_agent: NDArray[np.intp]

    def __init__(self, task_of_agent: ArrayLike) -> None:
        array = indices(task_of_agent, "task_of_agent", "must be a list of task indices, -1 for idle")
        if array.ndim != 1:
            raise InputError(f"an allocation needs one task index per agent, got shape {array.shape}", "task_of_agent")
        array.setflags(write=False)
        object.__setattr__(self, "task_of_agent", array)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Allocation) and np.array_equal(self.task_of_agent, other.task_of_agent)

    def __hash__(self) -> int:
        return hash(self.task_of_agent.tobytes())

    @classmethod
    def idle(cls, instance: Instance) -> "Allocation":
        """Return the allocation in which every agent is idle."""
        return cls(np.full(of_type(instance, Instance, "instance").n, IDLE))

    @classmethod
    def from_ids(cls, instance: Instance, assignment: Mapping[str, str | None]) -> "Allocation":
        """Build an allocation from ids; agents that `assignment` leaves out are idle.

        Raises
        ------
        InputError
            If an agent or task is unknown to `instance`.
        """
        of_type(assignment, Mapping, "assignment")
        tasks = np.full(of_type(instance, Instance, "instance").n, IDLE, dtype=np.intp)
        for agent, task in assignment.items():
            if agent not in instance.agent_index:
                raise InputError(
                    f"no agent {agent!r} in instance {instance.name!r}{nearest(agent, instance.agent_ids)}",
                    "assignment",
                )
            if task is not None and (not isinstance(task, str) or task not in instance.task_index):
                raise InputError(
                    f"no task {task!r} in instance {instance.name!r}{nearest(str(task), instance.task_ids)}",
                    f"assignment.{agent}",
                )
            tasks[instance.agent_index[agent]] = IDLE if task is None else instance.task_index[task]
        return cls(tasks)

    @classmethod
    def carried_over(cls, instance: Instance, assignment: Mapping[str, str | None]) -> "tuple[Allocation, CarriedOver]":
        """Adapt a plan to an instance that has changed since, and return it with the changes.

        Agents that no longer exist are dropped; agents whose task no longer exists are idle.

        Raises
        ------
        InputError
            If the plan contains no agent of `instance`, or a task is not a string.
        """
        for name, task in assignment.items():
            if not isinstance(task, str | None):
                raise InputError(f"must be the id of a task, or None, got {task!r}", f"assignment.{name}")
        here = {name: task for name, task in assignment.items() if name in instance.agent_index}
        if assignment and not here:
            raise InputError(f"names no agent of instance {instance.name!r}", "assignment")
        lost = {name for name, task in here.items() if task is not None and task not in instance.task_index}
        plan = cls.from_ids(instance, {name: None if name in lost else task for name, task in here.items()})
        return plan, CarriedOver(
            gone_agents=tuple(name for name in assignment if name not in instance.agent_index),
            gone_tasks=tuple(dict.fromkeys(str(here[name]) for name in here if name in lost)),
            new_agents=tuple(name for name in instance.agent_ids if name not in assignment),
            agents_without_task=tuple(sorted(lost)),
        )

    def to_ids(self, instance: Instance) -> dict[str, str | None]:
        """Return the task id of each agent id, None for idle, in the order of the agents."""
        require_fit(of_type(instance, Instance, "instance"), self)
        ids: list[str | None] = [*instance.task_ids, None]
        return dict(zip(instance.agent_ids, map(ids.__getitem__, self.task_of_agent.tolist()), strict=True))


def require_fit(instance: Instance, allocation: Allocation) -> NDArray[np.intp]:
    """Return the task of each agent after checking that the allocation fits `instance`.

    Raises
    ------
    InputError
        If the number of agents differs, or a task index is out of range.
    """
    task = of_type(allocation, Allocation, "allocation").task_of_agent
    if len(task) != of_type(instance, Instance, "instance").n:
        message = f"the allocation has {len(task)} agents, instance {instance.name!r} has {instance.n}"
        raise InputError(message, "allocation")
    if task.min() < IDLE or task.max() >= instance.m:
        raise InputError(f"task indices must lie between -1 and {instance.m - 1}", "allocation")
    return task
