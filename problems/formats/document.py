"""Instances as plain objects, as JSON holds them (alloc-instance/1)."""

from collections.abc import Callable, Sequence
from typing import TypedDict, TypeGuard, TypeVar, cast

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import (
    AGENT_FIELDS,
    DEFAULT_ENERGY_PER_DISTANCE,
    DEFAULT_NAME,
    DEFAULT_TAU,
    INSTANCE_FORMAT,
    TASK_FIELDS,
    Columns,
    check_names,
    plain_numbers,
    require_format,
    unknown_field,
)
from alloc.problems.formats.json_text import require_object
from alloc.problems.formats.messages import described
from alloc.problems.instance import FloatArray, Instance

Row = dict[str, object]
Value = TypeVar("Value")

HEADER_FIELDS = ("format", "name", "tau", "energy_per_distance")
INSTANCE_FIELDS = (*HEADER_FIELDS, "agents", "tasks")


class HeaderValues(TypedDict):
    """The fields of `Columns` that concern neither a single agent nor a single task."""

    name: str
    tau: float
    energy_per_distance: float


def from_document(document: object, *, default_name: str = DEFAULT_NAME) -> Instance:
    """Return the instance that a document of plain objects describes.

    Parameters
    ----------
    document : dict
        As `json.load` gives it; see docs/formats.md.
    default_name : str
        The name of the instance where the document gives none.

    Raises
    ------
    InputError
        If the document breaks the rules of the format.
    """
    header = require_object(document)
    require_format(header.get("format"))
    require_known(header, INSTANCE_FIELDS, "")
    agents = _rows(header, "agents", AGENT_FIELDS)
    tasks = _rows(header, "tasks", TASK_FIELDS)
    return Columns(
        **header_values(header, default_name),
        agent_ids=_texts(agents, "agents", "id"),
        task_ids=_texts(tasks, "tasks", "id"),
        ability=_numbers(agents, "agents", "ability"),
        workload=_numbers(tasks, "tasks", "workload"),
        agent_position=_positions(agents, "agents"),
        task_position=_positions(tasks, "tasks"),
        start_task=_nullable_texts(agents, "agents", "start_task"),
        battery=_nullable_numbers(agents, "agents", "battery"),
        communication_range=_nullable_numbers(agents, "agents", "range"),
        speed=_nullable_numbers(agents, "agents", "speed"),
        tasks=_text_lists(agents, "agents", "tasks"),
        priority=_nullable_numbers(tasks, "tasks", "priority"),
    ).build()


def to_document(instance: Instance) -> Row:
    """Return `instance` as plain objects, ready for `json.dump`; `from_document` is the inverse.

    Raises
    ------
    InputError
        If an id holds what no file can keep.
    """
    check_names(instance)
    return {**header_document(instance), "agents": agent_rows(instance), "tasks": task_rows(instance)}


def agent_rows(instance: Instance) -> list[Row]:
    """Return the agents of an instance as plain objects."""
    agents = zip(
        instance.agent_ids,
        plain_numbers(instance.ability),
        plain_positions(instance.agent_position),
        start_task_ids(instance),
        plain_numbers(instance.battery),
        plain_numbers(instance.communication_range),
        plain_numbers(instance.speed),
        allowed_task_ids(instance),
        strict=True,
    )
    return [dict(zip(AGENT_FIELDS, row, strict=True)) for row in agents]


def task_rows(instance: Instance) -> list[Row]:
    """Return the tasks of an instance as plain objects."""
    tasks = zip(
        instance.task_ids,
        plain_numbers(instance.workload),
        plain_positions(instance.task_position),
        plain_numbers(instance.priority),
        strict=True,
    )
    return [dict(zip(TASK_FIELDS, row, strict=True)) for row in tasks]


def header_document(instance: Instance) -> Row:
    """Return what concerns neither a single agent nor a single task."""
    tau, energy = plain_numbers(np.array([instance.tau, instance.energy_per_distance]))
    return {"format": INSTANCE_FORMAT, "name": instance.name, "tau": tau, "energy_per_distance": energy}


def header_values(header: Row, default_name: str) -> HeaderValues:
    """Return name, tau and energy_per_distance, or what stands for them where they are absent."""
    name = header.get("name")
    if not isinstance(name, str | None):
        raise InputError(f"must be a string, got {described(name)}", "name")
    return {
        "name": default_name if name is None else name,
        "tau": _number(header, "tau", DEFAULT_TAU),
        "energy_per_distance": _number(header, "energy_per_distance", DEFAULT_ENERGY_PER_DISTANCE),
    }


def _number(header: Row, field: str, default: float) -> float:
    value = float(_numbers([header], "", field)[0])
    return default if np.isnan(value) else value


def require_known(row: Row, known: Sequence[str], place: str) -> None:
    """Raise `InputError` if an object has a field that the format does not know."""
    for field in row:
        if field not in known:
            raise InputError(unknown_field(str(field), known), place)


def start_task_ids(instance: Instance) -> list[str | None]:
    """Return the id of the task where each agent begins, None for none."""
    names: list[str | None] = [*instance.task_ids, None]
    return [names[task] for task in instance.start_task.tolist()]


def allowed_task_ids(instance: Instance) -> list[list[str] | None]:
    """Return the ids of the tasks that each agent may do, None for all."""
    if instance.allowed_tasks is None:
        return [None] * instance.n
    names = instance.task_ids
    return [None if tasks is None else [names[task] for task in tasks.tolist()] for tasks in instance.allowed_tasks]


def plain_positions(positions: FloatArray) -> list[list[float | int | None] | None]:
    """Return positions as written to text, None where unknown."""
    columns = (plain_numbers(column) for column in positions.T)
    return [None if row[0] is None else list(row) for row in zip(*columns, strict=True)]


def _rows(document: Row, kind: str, known: Sequence[str]) -> list[Row]:
    rows = document.get(kind)
    if rows is None:
        raise InputError(f"is missing; list at least one of the {kind}", kind)
    if not isinstance(rows, list):
        raise InputError(f"must be a list, got {described(rows)}", kind)
    if not set(map(type, rows)) <= {dict}:
        for index, row in enumerate(rows):
            require_object(row, f"{kind}[{index}]")
    if not set().union(*rows) <= set(known):
        for index, row in enumerate(rows):
            require_known(row, known, f"{kind}[{index}]")
    return rows


def _column(
    rows: list[Row], kind: str, field: str, types: set[type], fits: Callable[[object], TypeGuard[Value]], rule: str
) -> list[Value]:
    """One field of all rows, None where absent; `types` settles at once what `fits` decides one by one."""
    column = [row.get(field) for row in rows]
    if not set(map(type, column)) <= types:
        for index, value in enumerate(column):
            if not fits(value):
                raise InputError(f"must be {rule}, got {described(value)}", _place(kind, index, field))
    return cast("list[Value]", column)


def _place(kind: str, index: int, field: str) -> str:
    return f"{kind}[{index}].{field}" if kind else field


def _nullable_numbers(rows: list[Row], kind: str, field: str) -> FloatArray | None:
    """The numbers of a field, NaN for null; None if all are null."""
    values = _numbers(rows, kind, field)
    return None if np.isnan(values).all() else values


def _numbers(rows: list[Row], kind: str, field: str) -> FloatArray:
    """The numbers of a field, NaN for null."""
    column = _column(rows, kind, field, {float, int, type(None)}, _is_number_or_null, "a number")
    try:
        values = np.array(column, dtype=np.float64)
    except OverflowError:
        values = np.array([_float(value) for value in column])
    if np.isnan(values).sum() > column.count(None):
        index = next(index for index, value in enumerate(column) if value is not None and value != value)
        raise InputError("must be a finite number, got NaN", _place(kind, index, field))
    return values


def _float(value: float | None) -> float:
    try:
        return float("nan") if value is None else float(value)
    except OverflowError:
        return float("inf")


def _texts(rows: list[Row], kind: str, field: str) -> list[str]:
    return _column(rows, kind, field, {str}, _is_text, "a non-empty string")


def _nullable_texts(rows: list[Row], kind: str, field: str) -> list[str | None] | None:
    column = _column(rows, kind, field, {str, type(None)}, _is_text_or_null, "the id of a task, or null")
    return _unless_all_null(column)


def _text_lists(rows: list[Row], kind: str, field: str) -> list[Sequence[str] | None] | None:
    column = _column(rows, kind, field, {list, type(None)}, _is_list_or_null, "a list of task ids, or null")
    given = [entry for entry in column if entry is not None]
    if not {type(name) for names in given for name in names} <= {str}:
        for index, entry in enumerate(column):
            for position, name in enumerate(entry or ()):
                if not isinstance(name, str):
                    raise InputError(
                        f"must be the id of a task, got {described(name)}", f"{kind}[{index}].{field}[{position}]"
                    )
    return _unless_all_null(cast("list[Sequence[str] | None]", column))


def _positions(rows: list[Row], kind: str) -> FloatArray | None:
    column = _column(rows, kind, "position", {list, type(None)}, _is_list_or_null, "a list of 2 or 3 numbers, or null")
    given = [index for index, entry in enumerate(column) if entry is not None]
    if not given:
        return None
    entries = [entry for entry in column if entry is not None]
    if not set(map(len, entries)) <= {2, 3} or not {type(x) for entry in entries for x in entry} <= {float, int}:
        for index, entry in zip(given, entries, strict=True):
            _check_position(entry, f"{kind}[{index}].position")
    places = cast("list[Sequence[float]]", entries)
    if set(map(len, places)) != {3}:
        places = [place if len(place) == 3 else [*place, 0.0] for place in places]
    positions = np.full((len(rows), 3), np.nan)
    try:
        positions[given] = places
    except OverflowError:
        positions[given] = [[_float(value) for value in place] for place in places]
    if not np.isfinite(positions[given]).all():
        row = given[int(np.argmin(np.isfinite(positions[given]).all(axis=1)))]
        wrong = next(value for value in positions[row].tolist() if not np.isfinite(value))
        raise InputError(f"must be finite numbers, got {described(wrong)}", f"{kind}[{row}].position")
    return positions


def _check_position(entry: Sequence[object], place: str) -> None:
    if len(entry) not in (2, 3):
        raise InputError(f"must have 2 or 3 coordinates, got {len(entry)}", place)
    for axis, value in enumerate(entry):
        if value is None or not _is_number_or_null(value):
            raise InputError(f"must be a number, got {described(value)}", f"{place}[{axis}]")


def _is_number_or_null(value: object) -> TypeGuard[float | int | None]:
    return value is None or (isinstance(value, float | int) and not isinstance(value, bool))


def _is_text(value: object) -> TypeGuard[str]:
    return isinstance(value, str)


def _is_text_or_null(value: object) -> TypeGuard[str | None]:
    return isinstance(value, str | None)


def _is_list_or_null(value: object) -> TypeGuard[Sequence[object] | None]:
    return isinstance(value, list | tuple | None)


def _unless_all_null(column: list[Value | None]) -> list[Value | None] | None:
    return None if column.count(None) == len(column) else column
