"""Grids of cells, from files, data frames, lists and dicts."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Protocol, TypeGuard, cast

import numpy as np

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError

Cell = object
"""None, a stripped text, a number, a boolean, a date or a list."""


@dataclass(frozen=True)
class Grid:
    """Rows of cells, with information from the reader of the file.

    Attributes
    ----------
    source : str
        Name of the file or argument.
    rows : list of list of object
    places : list of str
        Name of each row in messages, such as ``line 3``.
    has_header : bool
        Whether the first row is known to be the header; otherwise the header is searched for.
    decimal_point : bool
        Whether a point is always a decimal point.
    merged : frozenset of (int, int)
        Row and column of merged cells.
    notes : tuple of str
        Remarks of the reader.
    """

    source: str
    rows: list[list[Cell]]
    places: list[str]
    has_header: bool = False
    decimal_point: bool = False
    merged: frozenset[tuple[int, int]] = field(default=frozenset())
    notes: tuple[str, ...] = ()


class Frame(Protocol):
    """Required interface of a data frame of pandas or a similar library."""

    columns: Iterable[object]

    def __getitem__(self, name: object, /) -> Iterable[object]: ...


def grid_of(given: object, source: str) -> Grid:
    """Return the cells of a grid, a data frame, a dict of columns or a list of dicts.

    Raises
    ------
    InputError
        If it is none of these, or its columns have unequal lengths.
    """
    if isinstance(given, Grid):
        return given
    columns = _columns(given, source)
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"has columns of unequal length: {lengths}", source)
    header: list[Cell] = [clean(name) for name in columns]
    rows = [[clean(cell) for cell in row] for row in zip(*columns.values(), strict=True)]
    places = ["the header", *(f"row {number}" for number in range(len(rows)))]
    return Grid(source, [header, *rows], places, has_header=True, decimal_point=True)


def _columns(given: object, source: str) -> dict[object, Sequence[object]]:
    if isinstance(given, Mapping):
        return {name: _cells(values, f"{source}[{name!r}]") for name, values in given.items()}
    if _is_frame(given):
        return {**_index(given), **{name: list(given[name]) for name in given.columns}}
    rows = _cells(given, source)
    for number, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise InputError(f"must be a dict of columns' names and cells, got {shown(row)}", f"{source}[{number}]")
    entries = cast("Sequence[Mapping[object, object]]", rows)
    names = dict.fromkeys(name for row in entries for name in row)
    return {name: [row.get(name) for row in entries] for name in names}


def _cells(values: object, place: str) -> list[object]:
    if isinstance(values, Iterable) and not isinstance(values, str | bytes):
        return list(values)
    raise InputError(f"must be a table: a data frame, a dict of columns or a list of dicts, got {shown(values)}", place)


def _is_frame(given: object) -> TypeGuard[Frame]:
    return hasattr(given, "columns") and hasattr(given, "__getitem__")


def _index(frame: Frame) -> dict[object, Sequence[object]]:
    """Return the index of a data frame as columns, if it has a name or contains texts."""
    index = getattr(frame, "index", None)
    names = getattr(index, "names", None)
    if index is None or names is None or len(names) != 1:
        return {}
    values = list(index)
    is_column = names[0] is not None or (bool(values) and all(isinstance(value, str) for value in values))
    return {names[0] if names[0] is not None else "": values} if is_column else {}


def clean(cell: object) -> Cell:
    """Return a cell with numpy types converted, texts stripped, and missing values as None."""
    if isinstance(cell, np.generic):
        cell = cell.item()
    if isinstance(cell, np.ndarray):
        return cell.tolist()
    if isinstance(cell, str):
        return cell.strip(" \t\r\n\u00a0\ufeff") or None
    if cell is None or type(cell).__name__ in ("NAType", "NaTType"):
        return None
    return None if isinstance(cell, float) and cell != cell else cell


def as_text(cell: Cell) -> str:
    """Return a cell as text, with integers without a fraction, as spreadsheets show them."""
    if cell is None:
        return ""
    if isinstance(cell, float) and cell.is_integer():
        return str(int(cell))
    return str(cell)


def as_name(cell: Cell) -> str:
    """Return a cell as the name of an agent, a task or a skill, with whitespace collapsed to single spaces."""
    return " ".join(as_text(cell).split())


def is_real(cell: Cell) -> TypeGuard[float]:
    """Return whether the type of a cell is a number."""
    return isinstance(cell, Real) and not isinstance(cell, bool)
