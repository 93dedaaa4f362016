"""Comments at the head of a model: meaning of variables and names."""

import json
from collections.abc import Iterator, Sequence

import numpy as np

from alloc.problems.models.grouping import Grouping
from alloc.problems.models.programme import RATIO, Programme
from alloc.problems.text import counted

IDS_PER_LINE, LONGEST_ID = 8, 60
"""Maximum number of members of a class per line, and of characters of an id, as some readers cut long lines."""

MEANINGS = {
    Grouping.AGENT: "x_AGENT__TASK: 1 if the agent does the task",
    Grouping.ABILITY: "n_AGENT__TASK: how many agents of the class of AGENT do the task",
    Grouping.PLACE: "p_AGENT__TASK: how many agents of the class of AGENT, with the same place, do the task",
}


def comments(programme: Programme) -> Iterator[str]:
    """Yield lines in ASCII: objective, meaning of variables, members of classes, and ids whose names differ.

    Parameters
    ----------
    programme : Programme
    """
    instance = programme.instance
    yield f"instance {_quoted(instance.name)}: {counted(instance.n, 'agent')}, {counted(instance.m, 'task')}"
    yield MEANINGS[programme.grouping]
    if programme.is_free:
        yield f"{RATIO}: {programme.hours!r} / T; the makespan T is minimised by maximising it"
    else:
        goal = "the energy is minimised" if programme.energy is not None else "any solution will do"
        yield f"every task is done within T = {programme.hours!r}; {goal}"
    if programme.scale != 1:
        yield f"abilities and workloads are multiplied by {programme.scale!r}"
    if programme.grouping is not Grouping.AGENT:
        yield from _members(programme)
    yield from _renamed("agent", instance.agent_ids, programme.agent_names)
    yield from _renamed("task", instance.task_ids, programme.task_names)


def _members(programme: Programme) -> Iterator[str]:
    """Yield the agents of each class that has a variable and several members."""
    groups, ids = programme.groups, programme.instance.agent_ids
    order = np.argsort(groups.class_of_agent, kind="stable")
    last = np.cumsum(groups.count)
    for k in programme.used.tolist():
        members = order[last[k] - groups.count[k] : last[k]].tolist()
        for begin in range(0, len(members) if len(members) > 1 else 0, IDS_PER_LINE):
            listed = ", ".join(_quoted(ids[i]) for i in members[begin : begin + IDS_PER_LINE])
            yield f"class {programme.class_names[k]}: {listed}"


def _renamed(kind: str, ids: Sequence[str], names: Sequence[str]) -> Iterator[str]:
    """Yield the id of each name that differs from it."""
    yield from (f"{kind} {name}: {_quoted(own)}" for name, own in zip(names, ids, strict=True) if name != own)


def _quoted(name: str) -> str:
    text = json.dumps(name)
    return text if len(text) <= LONGEST_ID else f'{text[: LONGEST_ID - 4]}..."'
