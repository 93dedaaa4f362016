"""Reading and writing of CSV tables, by column and with line numbers."""

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from pathlib import Path

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import unknown_field
from alloc.problems.formats.files import read_text
from alloc.problems.formats.messages import quoted
from alloc.problems.instance import FloatArray
from alloc.problems.text import counted

LONGEST_CELL = 131_072
"""Longest cell that Python's csv module reads; spreadsheets have lower limits."""


@dataclass(frozen=True)
class Table:
    """A CSV file: cells by column, and the line on which each row ends."""

    file: str
    cells: dict[str, list[str]]
    lines: list[int]

    def place(self, row: int, column: str) -> str:
        """Return the place of a cell as text."""
        return f"{_line(self.file, self.lines[row])}, column {column}"

    def numbers(self, column: str) -> FloatArray | None:
        """Return a column of numbers, NaN for empty cells; None if the table lacks it."""
        if column not in self.cells:
            return None
        cells = self.cells[column]
        given = list(map(bool, cells))
        try:
            return self._parse(cells, given)
        except ValueError as error:
            row = next(row for row, cell in enumerate(cells) if cell and not _is_number(cell))
            raise InputError(f"must be a number, got {quoted(cells[row])}", self.place(row, column)) from error

    def _parse(self, cells: list[str], given: list[bool]) -> FloatArray:
        values = np.full(len(cells), np.nan)
        text = "".join(cells)
        if not text.isascii() or "_" in text:
            raise ValueError("not a number in the usual notation, although Python's float accepts it")
        values[given] = list(map(float, compress(cells, given)))
        if not np.isfinite(values[given]).all():
            raise ValueError("not finite")
        return values

    def positions(self, axes: Sequence[str]) -> FloatArray:
        """Return three columns of coordinates; the last is 0 if only two are given; NaN if none are."""
        unknown = np.full(len(self.lines), np.nan)
        x, y, z = (unknown if column is None else column for column in map(self.numbers, axes))
        half = (np.isnan(x) != np.isnan(y)) | (np.isnan(x) & ~np.isnan(z))
        if half.any():
            row = int(np.argmax(half))
            missing = axes[0] if np.isnan(x[row]) else axes[1]
            raise InputError(f"is missing; a position needs {axes[0]} and {axes[1]}", self.place(row, missing))
        return np.column_stack([x, y, np.where(np.isnan(z) & ~np.isnan(x), 0.0, z)])

    def texts(self, column: str) -> list[str | None] | None:
        """Return a column of strings, None for empty cells; None if the table lacks it."""
        return [cell or None for cell in self.cells[column]] if column in self.cells else None

    def lists(self, column: str) -> list[list[str] | None] | None:
        """Return a column of lists of strings, None for empty cells; None if the table lacks it."""
        return list(map(split_ids, self.cells[column])) if column in self.cells else None

    def returns(self, column: str) -> list[bool | str] | None:
        """Return a column of true, false and ids of bases, false for empty cells; None if the table lacks it."""
        if column not in self.cells:
            return None
        words = {"true": True, "false": False, "": False}
        return [words.get(cell.strip().lower(), cell) for cell in self.cells[column]]


def read_table(path: Path, known: Sequence[str], required: Sequence[str]) -> Table:
    """Return the table in a CSV file.

    Raises
    ------
    InputError
        If it cannot be read, is not CSV, has a column that is not in `known`, or lacks a `required` one.
    """
    try:
        text = read_text(path)
    except InputError as error:
        raise InputError(error.message, f"{path.name} {error.place}".rstrip()) from error
    return parse_table(text, required, known, path.name)


def parse_table(text: str, required: Sequence[str], known: Sequence[str] | None = None, file: str = "") -> Table:
    """Return the table in the text of a CSV file.

    Parameters
    ----------
    text : str
    required : sequence of str
        Required columns.
    known : sequence of str, optional
        Allowed columns; by default all.
    file : str
        Name of the file in a folder, for errors.

    Raises
    ------
    InputError
        If it is not CSV, has a column that is not in `known`, or lacks a `required` one.
    """
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        for row in reader:
            if any(map(str.strip, row)):  # a spreadsheet writes an empty row as commas alone
                rows.append(row)
                lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"is not CSV: {error}", _line(file, reader.line_num)) from error
    if not rows:
        raise InputError(f"is empty; its first line must name the columns: {','.join(known or required)}", file)
    names = [name.strip() for name in rows[0]]
    _check_names(names, known, required, _line(file, lines[0]))
    if set(map(len, rows)) != {len(names)}:
        row, line = next((r, n) for r, n in zip(rows, lines, strict=True) if len(r) != len(names))
        raise InputError(
            f"has {counted(len(row), 'cell')}, but there are {counted(len(names), 'column')}", _line(file, line)
        )
    cells = [list(column) for column in zip(*rows[1:], strict=True)] or [[] for _ in names]
    return Table(file, dict(zip(names, cells, strict=True)), lines[1:])


def _line(file: str, number: int) -> str:
    return f"{file} line {number}".lstrip()


def _check_names(names: list[str], known: Sequence[str] | None, required: Sequence[str], place: str) -> None:
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise InputError("has one column only; separate columns by commas", place)
    for name in names:
        if known is not None and name not in known:
            raise InputError(unknown_field(name, known, "column"), place)
        if names.count(name) > 1:
            raise InputError(f"the column {name!r} occurs twice; remove one", place)
    for name in required:
        if name not in names:
            raise InputError(f"the column {name!r} is missing", place)


def _is_number(cell: str) -> bool:
    try:
        return cell.isascii() and "_" not in cell and bool(np.isfinite(float(cell)))
    except ValueError:
        return False


def table_text(columns: Mapping[str, Sequence[object]]) -> str:
    """Return columns as CSV text."""
    cells = [_cells(values) for values in columns.values()]
    return "\n".join([",".join(columns), *map(",".join, zip(*cells, strict=True)), ""])


def _cells(values: Sequence[object]) -> list[str]:
    """Return values as cells, quoted if needed."""
    cells = ["" if value is None else _cell(value) for value in values]
    if re.search(r'[",\r\n]', "".join(cells)):
        cells = ['"' + cell.replace('"', '""') + '"' if re.search(r'[",\r\n]', cell) else cell for cell in cells]
    longest = max(map(len, cells), default=0)
    if longest > LONGEST_CELL:
        raise InputError(f"a cell would have {longest} characters, more than CSV readers accept; use .json or .npz")
    return cells


def _cell(value: object) -> str:
    if isinstance(value, list):
        return join_ids(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    return value if isinstance(value, str) else repr(value)


def join_ids(ids: Iterable[str]) -> str:
    r"""Return ids in one cell, separated by ``;``; ``;`` and ``\`` in an id are escaped by ``\``."""
    return ";".join(re.sub(r"([;\\])", r"\\\1", name) for name in ids) or ";"


def split_ids(cell: str) -> list[str] | None:
    """Return the ids in a cell, None if it is empty; empty ids are dropped, so that ``;`` is the empty list."""
    if not cell:
        return None
    if "\\" not in cell:
        return [name for name in cell.split(";") if name]
    names = re.findall(r"(?:[^;\\]|\\.|\\$)+", cell, re.DOTALL)
    return [re.sub(r"\\(.)", r"\1", name, flags=re.DOTALL) for name in names]
