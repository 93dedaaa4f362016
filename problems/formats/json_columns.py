"""Extraction and validation of one field of all agents or tasks in a JSON document."""

from collections.abc import Callable, Sequence
from typing import TypeGuard, TypeVar, cast

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import unknown_field
from alloc.problems.formats.json_text import require_object
from alloc.problems.formats.messages import described
from alloc.problems.instance import FloatArray

Row = dict[str, object]
Value = TypeVar("Value")


def require_known(row: Row, known: Sequence[str], place: str) -> None:
    """Raise `InputError` if an object has an unknown field."""
    for field in row:
        if field not in known:
            raise InputError(unknown_field(str(field), known), place)


def rows(document: Row, kind: str, known: Sequence[str]) -> list[Row]:
    """Return the agents or the tasks of a document, after checking that their fields are known."""
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
    """Return one field of all rows, None if absent; `types` is a fast check before `fits` per value."""
    column = [row.get(field) for row in rows]
    if not set(map(type, column)) <= types:
        for index, value in enumerate(column):
            if not fits(value):
                raise InputError(f"must be {rule}, got {described(value)}", _place(kind, index, field))
    return cast("list[Value]", column)


def _place(kind: str, index: int, field: str) -> str:
    return f"{kind}[{index}].{field}" if kind else field


def nullable_numbers(rows: list[Row], kind: str, field: str) -> FloatArray | None:
    """Return the numbers of a field, NaN for null; None if all are null."""
    values = numbers(rows, kind, field)
    return None if np.isnan(values).all() else values


def numbers(rows: list[Row], kind: str, field: str) -> FloatArray:
    """Return the numbers of a field, NaN for null."""
    column = _column(rows, kind, field, {float, int, type(None)}, _is_number_or_null, "a number")
    values = _as_floats(column)
    if np.isnan(values).sum() > column.count(None):
        index = next(index for index, value in enumerate(column) if value is not None and value != value)
        raise InputError("must be a finite number, got NaN", _place(kind, index, field))
    return values


def required_numbers(values: Sequence[object], place: str) -> FloatArray:
    """Return numbers, none of which may be null; the index of an invalid one is inserted into `place`."""
    if not set(map(type, values)) <= {float, int}:
        for index, value in enumerate(values):
            if value is None or not _is_number_or_null(value):
                raise InputError(f"must be a number, got {described(value)}", place.format(index))
    return _as_floats(cast("Sequence[float | None]", values))


def _as_floats(values: Sequence[float | None]) -> FloatArray:
    try:
        return np.array(values, dtype=np.float64)
    except OverflowError:
        return np.array([_float(value) for value in values])


def _float(value: float | None) -> float:
    try:
        return float("nan") if value is None else float(value)
    except OverflowError:
        return float("inf")


def texts(rows: list[Row], kind: str, field: str) -> list[str]:
    """Return the strings of a field, none of which may be null."""
    return _column(rows, kind, field, {str}, _is_text, "a non-empty string")


def nullable_texts(rows: list[Row], kind: str, field: str) -> list[str | None] | None:
    """Return the task ids of a field; None if all are null."""
    column = _column(rows, kind, field, {str, type(None)}, _is_text_or_null, "the id of a task, or null")
    return _unless_all_null(column)


def text_lists(
    rows: list[Row], kind: str, field: str, entry_rule: str = "the id of a task", list_rule: str = "a list of task ids"
) -> list[Sequence[str] | None] | None:
    """Return the lists of strings of a field; None if all are null."""
    column = _column(rows, kind, field, {list, type(None)}, _is_list_or_null, f"{list_rule}, or null")
    given = [entry for entry in column if entry is not None]
    if not {type(name) for names in given for name in names} <= {str}:
        for index, entry in enumerate(column):
            for position, name in enumerate(entry or ()):
                if not isinstance(name, str):
                    place = f"{kind}[{index}].{field}[{position}]"
                    raise InputError(f"must be {entry_rule}, got {described(name)}", place)
    return _unless_all_null(cast("list[Sequence[str] | None]", column))


def name_lists(rows: list[Row], kind: str, field: str) -> list[Sequence[str] | None] | None:
    """Return the lists of names of a field, such as skills; None if all are null."""
    return text_lists(rows, kind, field, "a string", "a list of strings")


def returns(rows: list[Row], kind: str, field: str) -> list[bool | str] | None:
    """Return the booleans and base ids of a field, False for null; None if all are null."""
    rule = "true, false or the id of a base"
    column = _column(rows, kind, field, {bool, str, type(None)}, _is_return_or_null, rule)
    return None if column.count(None) == len(column) else [False if value is None else value for value in column]


def positions(rows: list[Row], kind: str) -> FloatArray | None:
    """Return the positions, shape (rows, 3), NaN for null; None if all are null."""
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


def _is_return_or_null(value: object) -> TypeGuard[bool | str | None]:
    return isinstance(value, bool | str | None)


def _is_text(value: object) -> TypeGuard[str]:
    return isinstance(value, str)


def _is_text_or_null(value: object) -> TypeGuard[str | None]:
    return isinstance(value, str | None)


def _is_list_or_null(value: object) -> TypeGuard[Sequence[object] | None]:
    return isinstance(value, list | tuple | None)


def _unless_all_null(column: list[Value | None]) -> list[Value | None] | None:
    return None if column.count(None) == len(column) else column
