"""Instances with fewer agents or tasks."""

from collections.abc import Callable, Iterable, Sequence, Set
from dataclasses import fields
from typing import TYPE_CHECKING, cast

import numpy as np

from alloc.problems.arguments import listed, shown
from alloc.problems.distances.build import restricted_reach
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import IntArray
from alloc.problems.vocabulary import IDLE

if TYPE_CHECKING:
    from alloc.problems.instance import Instance

AGENT_ARRAYS = (
    "ability",
    "agent_position",
    "start_task",
    "battery",
    "communication_range",
    "speed",
    "agent_energy_per_distance",
    "returns",
    "return_base",
)
"""Fields of an instance with one row per agent; ids, allowed tasks and skills are tuples."""


def restricted(instance: "Instance", agents: IntArray, tasks: IntArray) -> "Instance":
    """Return the subproblem of the given agents and tasks, in this order; starts of agents do not change.

    Parameters
    ----------
    instance : Instance
    agents, tasks : ndarray of int
        Distinct indices.
    """
    number = np.full(instance.m + 1, IDLE, dtype=np.intp)
    number[tasks] = np.arange(len(tasks))
    start = number[instance.start_task[agents]]
    position = instance.agent_position[agents].copy()
    left = (instance.start_task[agents] != IDLE) & (start == IDLE) & np.isnan(position[:, 0])
    position[left] = instance.start_position[agents[left]]
    lists, table = instance.allowed_tasks, instance.distances
    if table is not None:  # agents keep the distances of removed start tasks
        table = table.with_rows_of_starts(agents[left], instance.start_task[agents[left]])
    rows = agent_rows(instance, agents)
    rows |= {"agent_position": position, "start_task": start}
    rows["allowed_tasks"] = None if lists is None else tuple(_renamed(lists[i], number) for i in agents.tolist())
    part = replaced(
        instance,
        **rows,
        task_ids=tuple(instance.task_ids[j] for j in tasks.tolist()),
        workload=instance.workload[tasks],
        task_position=instance.task_position[tasks],
        priority=instance.priority[tasks],
        needs=None if instance.needs is None else tuple(instance.needs[j] for j in tasks.tolist()),
        distances=None if table is None else table.restricted(agents, tasks),
    )
    if instance.reach.move is not None:  # not part of the fields
        part.__dict__["reach"] = restricted_reach(instance.reach, agents, tasks)
    return part


def without_agents(instance: "Instance", gone: Iterable[str]) -> "Instance":
    """Return the instance without these agents, as after failures.

    Parameters
    ----------
    instance : Instance
    gone : iterable of str
        Their ids.

    Raises
    ------
    InputError
        If an id is unknown, or no agent remains.
    """
    left = _others(instance.agent_ids, gone, "agent", instance.name)
    return with_rows(instance, left, np.arange(instance.m))


def without_tasks(instance: "Instance", gone: Iterable[str]) -> "Instance":
    """Return the instance without these tasks; agents that start there keep their places.

    Parameters
    ----------
    instance : Instance
    gone : iterable of str
        Their ids.

    Raises
    ------
    InputError
        If an id is unknown, or no task remains.
    """
    left = _others(instance.task_ids, gone, "task", instance.name)
    if not len(left):
        raise InputError("an instance needs at least one task", "tasks")
    return restricted(instance, np.arange(instance.n), left)


def replaced(instance: "Instance", **changed: object) -> "Instance":
    """Return a copy of the instance with some fields changed; the constructor validates them."""
    make = cast("Callable[..., Instance]", type(instance))
    return make(**{field.name: getattr(instance, field.name) for field in fields(instance)} | changed)


def agent_rows(instance: "Instance", agents: IntArray, names: Sequence[str] = ()) -> dict[str, object]:
    """Return the fields of the agents with these indices; the last ones get the ids `names`."""
    kept = agents.tolist()
    rows: dict[str, object] = {name: getattr(instance, name)[agents] for name in AGENT_ARRAYS}
    ids = [instance.agent_ids[i] for i in kept]
    rows["agent_ids"] = (*ids[: len(ids) - len(names)], *names)
    rows["skills"] = None if instance.skills is None else tuple(instance.skills[i] for i in kept)
    lists = instance.allowed_tasks
    rows["allowed_tasks"] = None if lists is None else tuple(lists[i] for i in kept)
    return rows


def with_rows(instance: "Instance", agents: IntArray, tasks: IntArray, names: Sequence[str] = ()) -> "Instance":
    """Return the instance with the agents and tasks of these indices; repeated agents get the ids `names`."""
    table = instance.distances
    return replaced(
        instance,
        **agent_rows(instance, agents, names),
        distances=None if table is None else table.restricted(agents, tasks),
    )


def _renamed(tasks: IntArray | None, number: IntArray) -> IntArray | None:
    return None if tasks is None else number[tasks][number[tasks] != IDLE]


def _others(ids: Sequence[str], gone: Iterable[str], kind: str, name: str) -> IntArray:
    """Return the indices of all ids that are not in `gone`."""
    dropped = gone if isinstance(gone, Set) else listed(gone, "gone", f"ids of {kind}s")
    known = set(ids)
    for one in dropped:
        if not isinstance(one, str):
            raise InputError(f"must be ids of {kind}s, got {shown(one)}", "gone")
        if one not in known:
            raise InputError(f"no {kind} {one!r} in instance {name!r}{nearest(one, ids)}", "gone")
    names = set(dropped)
    return np.array([index for index, one in enumerate(ids) if one not in names], dtype=np.intp)
