"""Agents pinned to tasks, given as ``AGENT=TASK`` or in a file, and checked against the instance."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from alloc.problems import IDLE, Allocation, InputError, Instance
from alloc.problems.errors import nearest
from alloc.problems.evaluation import reason_of
from alloc.problems.formats import read_plan
from alloc.problems.formats.files import PathLike
from alloc.problems.formats.messages import told

SIGN = "="


def pinned(instance: Instance, agent: str, task: str | None) -> tuple[int, int]:
    """Return the indices of an agent and of the task that it is pinned to, -1 for idle.

    Raises
    ------
    InputError
        If one of them is unknown, or the agent cannot do the task.
    """
    if agent not in instance.agent_index:
        raise InputError(
            f"no agent {agent!r} in instance {instance.name!r}{nearest(agent, instance.agent_ids)}", "pins"
        )
    i = instance.agent_index[agent]
    if task is None:
        return i, IDLE
    if task not in instance.task_index:
        raise InputError(f"no task {task!r} in instance {instance.name!r}{nearest(task, instance.task_ids)}", "pins")
    j = instance.task_index[task]
    if not instance.reach.allows(np.array([i]), np.array([j]))[0]:
        raise InputError(f"{agent!r} cannot do {task!r}: {reason_of(instance, i, j)}", "pins")
    return i, j


def parse_pin(instance: Instance, pair: str) -> tuple[str, str | None]:
    """Return the agent and the task in ``AGENT=TASK``; the task is None in ``AGENT=``.

    Ids may contain ``=``: the text is split such that both sides are ids of the instance. If there is no such split,
    the longest known agent is taken, so that the error is about the task.

    Raises
    ------
    InputError
        If there is no ``=``, or several splits are possible.
    """
    splits = [(pair[:at], pair[at + 1 :] or None) for at, sign in enumerate(pair) if sign == SIGN and at]
    if not splits:
        raise InputError(f"must be AGENT=TASK, got {pair!r}", "pins")
    known = [(agent, task) for agent, task in splits if agent in instance.agent_index]
    possible = [(agent, task) for agent, task in known if task is None or task in instance.task_index]
    if len(possible) > 1:
        meanings = " or ".join(f"agent {agent!r} to {_named(task)}" for agent, task in possible)
        raise InputError(f"{pair!r} may pin {meanings}; pin it in a file", "pins")
    return (possible or known[-1:] or splits)[0]


def _named(task: str | None) -> str:
    return "no task" if task is None else f"task {task!r}"


def parse_pins(instance: Instance, pairs: Iterable[str]) -> dict[str, str | None]:
    """Return the task id of each agent id from several texts ``AGENT=TASK``.

    Raises
    ------
    InputError
        As for `parse_pin`, and if an agent is pinned to two tasks.
    """
    found: dict[str, str | None] = {}
    for agent, task in (parse_pin(instance, pair) for pair in pairs):
        if found.setdefault(agent, task) != task:
            raise InputError(f"{agent!r} is pinned to {_named(found[agent])} and to {_named(task)}", "pins")
    return found


def read_pins(instance: Instance, path: PathLike) -> tuple[dict[str, str | None], str | None]:
    """Return the task id of each agent id in a plan file, all of whose agents are pinned.

    Parameters
    ----------
    instance : Instance
    path : str or path
        As for `read_plan`. Agents that are not in the instance, or whose tasks are not, are left out.

    Returns
    -------
    pins : dict
    note : str or None
        One line on what is left out, if anything is.

    Raises
    ------
    InputError
        If the file cannot be read, has no agent of the instance, or an agent cannot do its task.
    """
    plan = read_plan(path, instance)
    given = plan.assignment()
    try:
        _, changes = Allocation.carried_over(instance, given)
        left_out = {*changes.gone_agents, *changes.agents_without_task}
        pins = {agent: task for agent, task in given.items() if agent not in left_out}
        for agent, task in pins.items():
            _require(instance, agent, task)
    except InputError as error:
        raise told(error, plan.source) from error.__cause__
    gone = str(replace(changes, new_agents=()))
    return pins, f"{plan.source}: {gone} since; these pins are left out" if gone else None


def _require(instance: Instance, agent: str, task: str | None) -> None:
    """Check a pin; the `place` of an error is the position in the file."""
    try:
        pinned(instance, agent, task)
    except InputError as error:
        raise InputError(error.message, f"assignment.{agent}") from error
