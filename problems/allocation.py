"""An allocation: at most one task for each agent (5)."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from alloc.problems.errors import InputError, nearest
from alloc.problems.instance import IDLE, Instance


@dataclass(frozen=True, eq=False)
class Allocation:
    """The task of each agent.

    Parameters
    ----------
    task_of_agent : array_like of int, shape (n,)
        Task index of each agent, -1 for idle; copied, and read-only from then on.
    """

    task_of_agent: NDArray[np.intp]

    def __init__(self, task_of_agent: ArrayLike) -> None:
        array = np.array(task_of_agent, dtype=np.intp)
        if array.ndim != 1:
            raise InputError(f"an allocation needs one task index per agent, got shape {array.shape}")
        array.setflags(write=False)
        object.__setattr__(self, "task_of_agent", array)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Allocation) and np.array_equal(self.task_of_agent, other.task_of_agent)

    def __hash__(self) -> int:
        return hash(self.task_of_agent.tobytes())

    @classmethod
    def idle(cls, instance: Instance) -> "Allocation":
        """Return the allocation in which every agent is idle."""
        return cls(np.full(instance.n, IDLE))

    @classmethod
    def from_ids(cls, instance: Instance, assignment: Mapping[str, str | None]) -> "Allocation":
        """Build an allocation from ids; agents that `assignment` leaves out are idle.

        Raises
        ------
        InputError
            If an agent or task is unknown to `instance`.
        """
        tasks = np.full(instance.n, IDLE, dtype=np.intp)
        for agent, task in assignment.items():
            if agent not in instance.agent_index:
                raise InputError(
                    f"no agent {agent!r} in instance {instance.name!r}{nearest(agent, instance.agent_ids)}",
                    "assignment",
                )
            if task is not None and task not in instance.task_index:
                raise InputError(
                    f"no task {task!r} in instance {instance.name!r}{nearest(str(task), instance.task_ids)}",
                    f"assignment.{agent}",
                )
            tasks[instance.agent_index[agent]] = IDLE if task is None else instance.task_index[task]
        return cls(tasks)

    def to_ids(self, instance: Instance) -> dict[str, str | None]:
        """Return the task id of each agent id, None for idle, in the order of the agents."""
        ids: list[str | None] = [*instance.task_ids, None]
        return dict(zip(instance.agent_ids, map(ids.__getitem__, self.task_of_agent.tolist()), strict=True))
