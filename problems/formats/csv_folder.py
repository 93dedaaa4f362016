"""An instance as a folder of tables: agents.csv, tasks.csv and, optionally, instance.json."""

import csv
import io
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import compress
from pathlib import Path

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.columns import Columns, check_names, require_format, unknown_field
from alloc.problems.formats.document import (
    HEADER_FIELDS,
    HeaderValues,
    Row,
    agent_rows,
    header_document,
    header_values,
    require_known,
    task_rows,
)
from alloc.problems.formats.files import read_text, reason, write_text_atomically
from alloc.problems.formats.messages import quoted
from alloc.problems.instance import FloatArray, Instance

AGENT_COLUMNS = ("id", "ability", "x", "y", "z", "start_task", "battery", "range", "speed", "tasks")
TASK_COLUMNS = ("id", "workload", "x", "y", "z", "priority")

LONGEST_CELL = 131_072
"""What Python's csv module reads; spreadsheets stop earlier."""


@dataclass(frozen=True)
class Table:
    """A CSV file: cells by column, and the line on which each row ends."""

    file: str
    cells: dict[str, list[str]]
    lines: list[int]

    def place(self, row: int, column: str) -> str:
        """Return the place of a cell, in words."""
        return f"{self.file} line {self.lines[row]}, column {column}"

    def numbers(self, column: str) -> FloatArray | None:
        """Return a column of numbers, NaN where empty; None if the table does not have it."""
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
            raise ValueError("Python's float takes more than numbers are written in")
        values[given] = list(map(float, compress(cells, given)))
        if not np.isfinite(values[given]).all():
            raise ValueError("not finite")
        return values

    def positions(self) -> FloatArray | None:
        """Return columns x, y and z, with z = 0 where only x and y are given, NaN where none is."""
        x, y, z = (self.numbers(axis) for axis in "xyz")
        unknown = np.full(len(self.lines), np.nan)
        x, y, z = (unknown if axis is None else axis for axis in (x, y, z))
        half = (np.isnan(x) != np.isnan(y)) | (np.isnan(x) & ~np.isnan(z))
        if half.any():
            row = int(np.argmax(half))
            missing = "x" if np.isnan(x[row]) else "y"
            raise InputError("is missing; a position needs x and y", self.place(row, missing))
        return np.column_stack([x, y, np.where(np.isnan(z) & ~np.isnan(x), 0.0, z)])


def read_folder(folder: Path, default_name: str) -> Instance:
    """Return the instance in `folder`.

    Raises
    ------
    InputError
        If a file is absent or breaks the rules of the format; places name the file, its line and the column.
    """
    header = _read_header(folder / "instance.json", default_name)
    agents = _read_table(folder / "agents.csv", AGENT_COLUMNS, ("id", "ability"))
    tasks = _read_table(folder / "tasks.csv", TASK_COLUMNS, ("id", "workload"))
    starts, lists = agents.cells.get("start_task"), agents.cells.get("tasks")
    ability, workload = agents.numbers("ability"), tasks.numbers("workload")
    assert ability is not None, "a required column"
    assert workload is not None, "a required column"
    columns = Columns(
        **header,
        agent_ids=agents.cells["id"],
        task_ids=tasks.cells["id"],
        ability=ability,
        workload=workload,
        agent_position=agents.positions(),
        task_position=tasks.positions(),
        start_task=None if starts is None else [cell or None for cell in starts],
        battery=agents.numbers("battery"),
        communication_range=agents.numbers("range"),
        speed=agents.numbers("speed"),
        tasks=None if lists is None else [split_ids(cell) for cell in lists],
        priority=tasks.numbers("priority"),
    )
    try:
        return columns.build()
    except InputError as error:
        raise InputError(error.message, _translated(error.place, agents, tasks)) from error


def write_folder(instance: Instance, folder: Path) -> None:
    """Write `instance` into `folder`, which is made where it does not exist; files of other names stay.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    check_names(instance)
    texts = {
        "agents.csv": _table_text(agent_rows(instance), AGENT_COLUMNS),
        "tasks.csv": _table_text(task_rows(instance), TASK_COLUMNS),
        "instance.json": json_text.lines(header_document(instance)),
    }
    if os.path.lexists(folder):
        for name, text in texts.items():
            write_text_atomically(folder / name, text)
        return
    beside = folder.parent / f".alloc-{secrets.token_hex(8)}.tmp"
    try:
        beside.mkdir()
        for name, text in texts.items():
            write_text_atomically(beside / name, text)
        os.rename(beside, folder)
    except InputError as error:
        raise InputError(error.message) from error  # without the name of the temporary file
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be written: {reason(error)}") from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def join_ids(ids: Iterable[str]) -> str:
    r"""Return ids in one cell, separated by ``;``; ``;`` and ``\`` in an id get a ``\`` before them."""
    return ";".join(re.sub(r"([;\\])", r"\\\1", name) for name in ids) or ";"


def split_ids(cell: str) -> list[str] | None:
    """Return the ids in a cell, None if it is empty; empty ids are left out, so that ``;`` is the empty list."""
    if not cell:
        return None
    if "\\" not in cell:
        return [name for name in cell.split(";") if name]
    names = re.findall(r"(?:[^;\\]|\\.|\\$)+", cell, re.DOTALL)
    return [re.sub(r"\\(.)", r"\1", name, flags=re.DOTALL) for name in names]


def _read_header(path: Path, default_name: str) -> HeaderValues:
    if not os.path.lexists(path):
        return header_values({}, default_name)
    try:
        header = json_text.require_object(json_text.parse(read_text(path)))
        require_format(header.get("format"))
        require_known(header, HEADER_FIELDS, "")
        return header_values(header, default_name)
    except InputError as error:
        place = f"{path.name} {error.place}" if error.place.startswith("line") else f"{path.name}, {error.place}"
        raise InputError(error.message, place.removesuffix(", ")) from error


def _read_table(path: Path, known: Sequence[str], required: Sequence[str]) -> Table:
    try:
        text = read_text(path)
    except InputError as error:
        raise InputError(error.message, f"{path.name} {error.place}".rstrip()) from error
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[list[str]] = []
    lines: list[int] = []
    try:
        for row in reader:
            if any(map(str.strip, row)):  # a spreadsheet writes an empty row as commas alone
                rows.append(row)
                lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"is not CSV: {error}", f"{path.name} line {reader.line_num}") from error
    if not rows:
        raise InputError(f"is empty; its first line must name the columns: {','.join(known)}", path.name)
    names = [name.strip() for name in rows[0]]
    _check_names(names, known, required, f"{path.name} line {lines[0]}")
    if set(map(len, rows)) != {len(names)}:
        row, line = next((r, n) for r, n in zip(rows, lines, strict=True) if len(r) != len(names))
        raise InputError(f"has {len(row)} cells, but there are {len(names)} columns", f"{path.name} line {line}")
    cells = [list(column) for column in zip(*rows[1:], strict=True)] or [[] for _ in names]
    return Table(path.name, dict(zip(names, cells, strict=True)), lines[1:])


def _check_names(names: list[str], known: Sequence[str], required: Sequence[str], place: str) -> None:
    if len(names) == 1 and (";" in names[0] or "\t" in names[0]):
        raise InputError("has one column only; separate columns by commas", place)
    for name in names:
        if name not in known:
            raise InputError(unknown_field(name, known, "column"), place)
        if names.count(name) > 1:
            raise InputError(f"the column {name!r} occurs twice; remove one", place)
    for name in required:
        if name not in names:
            raise InputError(f"the column {name!r} is missing", place)


def _translated(place: str, agents: Table, tasks: Table) -> str:
    """Turn ``agents[3].ability`` into ``agents.csv line 5, column ability``."""
    match = re.fullmatch(r"(agents|tasks)(?:\[(\d+)\]\.(\w+))?", place)
    if match is None:
        return place and f"instance.json, {place}"
    table = agents if match[1] == "agents" else tasks
    return table.file if match[2] is None else table.place(int(match[2]), match[3])


def _is_number(cell: str) -> bool:
    try:
        return cell.isascii() and "_" not in cell and bool(np.isfinite(float(cell)))
    except ValueError:
        return False


def _table_text(rows: list[Row], columns: Sequence[str]) -> str:
    cells = (_cells([row.get(column) for row in rows]) for column in columns if column not in "xyz")
    by_name = dict(zip((column for column in columns if column not in "xyz"), cells, strict=True))
    positions = [row["position"] for row in rows]
    for axis, column in enumerate("xyz"):
        by_name[column] = _cells([place[axis] if isinstance(place, list) else None for place in positions])
    table = [by_name[column] for column in columns]
    return "\n".join([",".join(columns), *map(",".join, zip(*table, strict=True)), ""])


def _cells(values: Sequence[object]) -> list[str]:
    """Return values as cells, quoted where they need it."""
    cells = ["" if value is None else _cell(value) for value in values]
    if re.search(r'[",\r\n]', "".join(cells)):
        cells = ['"' + cell.replace('"', '""') + '"' if re.search(r'[",\r\n]', cell) else cell for cell in cells]
    longest = max(map(len, cells))
    if longest > LONGEST_CELL:
        raise InputError(f"a cell would have {longest} characters, more than CSV readers take; use .json or .npz")
    return cells


def _cell(value: object) -> str:
    if isinstance(value, list):
        return join_ids(value)
    return value if isinstance(value, str) else repr(value)
