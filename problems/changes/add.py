"""Instances with additional agents or tasks."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from alloc.problems.arguments import flag, listed, real, shown
from alloc.problems.changes.move import index_of, position, set_place, without_own
from alloc.problems.changes.remove import AGENT_ARRAYS, replaced, with_rows
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import IntArray
from alloc.problems.vocabulary import IDLE

if TYPE_CHECKING:
    from alloc.problems.instance import Instance

NUMBERS_OF_AGENT = {
    "ability": "ability",
    "battery": "battery",
    "range": "communication_range",
    "speed": "speed",
    "energy_per_distance": "agent_energy_per_distance",
}
"""Numeric fields of an agent in a file, and their names in an instance."""

AGENT_FIELDS = ("id", "like", "position", "start_task", "returns", "tasks", "skills", *NUMBERS_OF_AGENT)

TASK_FIELDS = ("id", "workload", "position", "priority", "needs")


def with_agents(instance: "Instance", added: Iterable[Mapping[str, object]]) -> "Instance":
    """Return the instance with agents appended.

    Parameters
    ----------
    instance : Instance
    added : iterable of mappings
        Fields of each agent as in a file; ``id`` is required, and ``ability`` unless ``like`` is the id of an agent
        from which all missing fields are copied, including user-given distances if no other place is given.

    Raises
    ------
    InputError
        If a field is unknown or invalid, or an id is already used.
    """
    rows = [
        _known(row, AGENT_FIELDS, f"agents[{number}]") for number, row in enumerate(listed(added, "added", "agents"))
    ]
    if not rows:
        return instance
    models = [index_of(instance, row["like"]) if row.get("like") is not None else 0 for row in rows]
    source = np.concatenate([np.arange(instance.n), np.array(models, dtype=np.intp)])
    grown = with_rows(instance, source, np.arange(instance.m), names=[_id(row, "agent") for row in rows])
    fields: dict[str, object] = {name: np.array(getattr(grown, name)) for name in AGENT_ARRAYS}
    lists: list[IntArray | None] = [None] * grown.n if grown.allowed_tasks is None else list(grown.allowed_tasks)
    skills: list[object] = [()] * grown.n if grown.skills is None else list(grown.skills)
    for index, row in enumerate(rows, start=instance.n):
        blank = row.get("like") is None
        _set_numbers(fields, row, index, blank=blank)
        if blank or "returns" in row:
            _set_return(fields, instance, row, index)
        if blank or "tasks" in row:
            lists[index] = _task_indices(instance, row.get("tasks"), index)
        if blank or "skills" in row:
            skills[index] = row.get("skills")
        if blank or "position" in row or "start_task" in row:
            set_place(fields, instance, row, index)
    elsewhere = np.array([row.get("like") is None or "position" in row or "start_task" in row for row in rows])
    return replaced(
        grown,
        **fields,
        allowed_tasks=lists,
        skills=skills,
        distances=without_own(grown.distances, np.append(np.zeros(instance.n, dtype=np.bool_), elsewhere)),
    )


def with_tasks(instance: "Instance", added: Iterable[Mapping[str, object]]) -> "Instance":
    """Return the instance with tasks appended; agents with a list of allowed tasks may not do them.

    Parameters
    ----------
    instance : Instance
    added : iterable of mappings
        Fields of each task as in a file; ``id`` and ``workload`` are required.

    Raises
    ------
    InputError
        If a field is unknown or invalid, or an id is already used.
    """
    rows = [_known(row, TASK_FIELDS, f"tasks[{number}]") for number, row in enumerate(listed(added, "added", "tasks"))]
    if not rows:
        return instance
    table, needs = instance.distances, [()] * instance.m if instance.needs is None else list(instance.needs)
    place = [position(row.get("position")) for row in rows]
    return replaced(
        instance,
        task_ids=(*instance.task_ids, *(_id(row, "task") for row in rows)),
        workload=[*instance.workload.tolist(), *(row.get("workload") for row in rows)],
        priority=[
            *instance.priority.tolist(),
            *(1.0 if row.get("priority") is None else row["priority"] for row in rows),
        ],
        task_position=np.vstack([instance.task_position, np.array(place).reshape(-1, 3)]),
        needs=[*needs, *(row.get("needs") for row in rows)],
        distances=None if table is None else table.with_more_tasks(len(rows)),
    )


def _known(row: Mapping[str, object], fields: Sequence[str], place: str) -> Mapping[str, object]:
    for field in row:
        if field not in fields:
            raise InputError(f"unknown field {field!r}{nearest(str(field), fields)}", place)
    return row


def _id(row: Mapping[str, object], kind: str) -> str:
    if not isinstance(row.get("id"), str):
        raise InputError(f"must be a string, got {shown(row.get('id'))}", f"{kind}s.id")
    return str(row["id"])


def _set_numbers(fields: dict[str, object], row: Mapping[str, object], index: int, *, blank: bool) -> None:
    for field, name in NUMBERS_OF_AGENT.items():
        array = fields[name]
        assert isinstance(array, np.ndarray)
        if blank or field in row:
            value = row.get(field)
            array[index] = np.nan if value is None else real(value, f"agents[{index}].{field}")


def _set_return(fields: dict[str, object], instance: "Instance", row: Mapping[str, object], index: int) -> None:
    """Set whether an agent returns, and where to: False, True for its start, or the id of a base."""
    given, place = row.get("returns"), f"agents[{index}].returns"
    returns, base = fields["returns"], fields["return_base"]
    assert isinstance(returns, np.ndarray)
    assert isinstance(base, np.ndarray)
    if isinstance(given, str) and given not in instance.bases.ids:
        known = nearest(given, instance.bases.ids) if instance.bases.ids else ""
        raise InputError(f"there is no base {given!r}{known}; give True, False or the id of a base", place)
    base[index] = instance.bases.ids.index(given) if isinstance(given, str) else IDLE
    returns[index] = isinstance(given, str) or (given is not None and flag(given, place))


def _task_indices(instance: "Instance", names: object, index: int) -> IntArray | None:
    if names is None:
        return None
    place = f"agents[{index}].tasks"
    wanted: list[object] = listed(cast("Iterable[object]", names), place, "ids of tasks")
    for name in wanted:
        if name not in instance.task_index:
            raise InputError(f"there is no task {shown(name)}{nearest(str(name), instance.task_ids)}", place)
    return np.array(sorted({instance.task_index[str(name)] for name in wanted}), dtype=np.intp)
