"""An allocation: at most one task for each agent (5)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import ReadOnly, indices
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE


@dataclass(frozen=True, eq=False)
class Allocation(ReadOnly):
    """The task of each agent.

    Parameters
    ----------
    task_of_agent : array_like of int, shape (n,)
        Task index of each agent, -1 for idle; copied, and read-only from then on.
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

    def to_ids(self, instance: Instance) -> dict[str, str | None]:
        """Return the task id of each agent id, None for idle, in the order of the agents."""
        require_fit(of_type(instance, Instance, "instance"), self)
        ids: list[str | None] = [*instance.task_ids, None]
        return dict(zip(instance.agent_ids, map(ids.__getitem__, self.task_of_agent.tolist()), strict=True))


def require_fit(instance: Instance, allocation: Allocation) -> NDArray[np.intp]:
    """Return the task of each agent, once it is clear that they are those of `instance`.

    Raises
    ------
    InputError
        If the allocation has another number of agents, or a task index out of range.
    """
    task = of_type(allocation, Allocation, "allocation").task_of_agent
    if len(task) != of_type(instance, Instance, "instance").n:
        message = f"the allocation has {len(task)} agents, instance {instance.name!r} has {instance.n}"
        raise InputError(message, "allocation")
    if task.min() < IDLE or task.max() >= instance.m:
        raise InputError(f"task indices must lie between -1 and {instance.m - 1}", "allocation")
    return task
