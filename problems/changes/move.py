"""Instances with agents at new places."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from alloc.problems.arguments import listed, of_type, shown
from alloc.problems.changes.remove import replaced
from alloc.problems.distances.given import DistanceTable
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import BoolArray, IntArray
from alloc.problems.vocabulary import IDLE

if TYPE_CHECKING:
    from alloc.problems.instance import Instance


def moved_to(instance: "Instance", places: Mapping[str, str | Sequence[float]]) -> "Instance":
    """Return the instance with agents at new places.

    Parameters
    ----------
    instance : Instance
    places : mapping
        For each id of an agent that has moved, the id of the task where it is now, or its coordinates. User-given
        distances of the agent are dropped, as they refer to its old place. An agent that returns still returns to its
        base or to its original start, which becomes a base.

    Raises
    ------
    InputError
        If an id is unknown, or a place is invalid.
    """
    fields: dict[str, object] = {name: np.array(getattr(instance, name)) for name in ("agent_position", "start_task")}
    moved = np.zeros(instance.n, dtype=np.bool_)
    for name, place in of_type(places, Mapping, "places").items():
        index = index_of(instance, name)
        moved[index] = True
        key = "start_task" if isinstance(place, str) else "position"
        set_place(fields, instance, {key: place}, index)
    kept = with_starts_as_bases(instance, np.flatnonzero(moved & instance.returns & (instance.return_base == IDLE)))
    return replaced(kept, **fields, distances=without_own(kept.distances, moved))


def with_starts_as_bases(instance: "Instance", agents: IntArray) -> "Instance":
    """Return the instance in which some agents return to bases at their starts.

    Agents with the same start and without user-given distances share a base, named after the first of them.

    Parameters
    ----------
    instance : Instance
    agents : ndarray of int
        Indices of the agents.
    """
    if not len(agents):
        return instance
    table, groups = instance.distances, dict[tuple[object, ...], list[int]]()
    owners = set() if table is None else {*table.source.tolist(), *table.target.tolist()}
    at_task = np.where(np.isnan(instance.agent_position[:, 0]), instance.start_task, IDLE)
    for agent in agents.tolist():
        place = (
            tuple(instance.start_position[agent].tolist()) if not np.isnan(instance.start_position[agent, 0]) else ()
        )
        groups.setdefault((place, at_task[agent], agent if agent in owners else IDLE), []).append(agent)
    bases, base = instance.bases, instance.return_base.copy()
    for group in groups.values():
        base[group] = len(bases.ids)
        name = bases.new_id(f"start of {instance.agent_ids[group[0]]}")
        bases = bases.with_more([name], instance.start_position[group[:1]])
    starts = [(group[0], int(at_task[group[0]])) for group in groups.values()]
    return replaced(
        instance,
        bases=bases,
        return_base=base,
        distances=None if table is None else table.with_bases_at(starts),
    )


def without_own(table: DistanceTable | None, agents: BoolArray) -> DistanceTable | None:
    """Return a table without the distances given for the agents in the mask `agents`, shape (n,)."""
    if table is None:
        return None
    dropped = np.append(agents, np.zeros(table.size - table.n, dtype=np.bool_))
    kept = ~(dropped[table.source] | dropped[table.target])
    return replace(table, source=table.source[kept], target=table.target[kept], distance=table.distance[kept])


def index_of(instance: "Instance", name: object) -> int:
    """Return the index of an agent by its id."""
    if not isinstance(name, str) or name not in instance.agent_index:
        raise InputError(
            f"no agent {shown(name)} in instance {instance.name!r}{nearest(str(name), instance.agent_ids)}"
        )
    return instance.agent_index[name]


def set_place(fields: dict[str, object], instance: "Instance", row: Mapping[str, object], index: int) -> None:
    """Set position and start task of an agent to those in `row`."""
    place, start = fields["agent_position"], fields["start_task"]
    assert isinstance(place, np.ndarray)
    assert isinstance(start, np.ndarray)
    task = row.get("start_task")
    if task is not None and (not isinstance(task, str) or task not in instance.task_index):
        raise InputError(f"no task {shown(task)} in instance {instance.name!r}{nearest(str(task), instance.task_ids)}")
    start[index] = IDLE if task is None else instance.task_index[str(task)]
    place[index] = position(row.get("position"))


def position(given: object) -> list[float]:
    """Return three coordinates; NaN for None."""
    if given is None:
        return [np.nan] * 3
    place: list[float] = listed(cast("Iterable[float]", given), "position", "2 or 3 numbers")
    if len(place) not in (2, 3) or not all(isinstance(x, int | float | np.number) for x in place):
        raise InputError(f"must be 2 or 3 numbers, got {shown(given)}", "position")
    return [float(x) for x in (*place, 0.0)[:3]]
