"""Detection of the layout of a table: header, row of units, totals, footnotes and empty rows."""

import re
from dataclasses import dataclass, field
from itertools import zip_longest

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.tables.grid import Cell, Grid, as_name, as_text, is_real
from alloc.problems.tables.language.digits import is_absent, split_number
from alloc.problems.tables.language.headers import Header, Kind, header_of, plain
from alloc.problems.tables.language.measures import measure_of
from alloc.problems.tables.language.synonyms import TOTALS

SEARCHED = 20
"""Number of rows among which the header is searched for."""


@dataclass(frozen=True)
class Table:
    """A table: headers and rows.

    Attributes
    ----------
    source : str
    headers : list of Header
    rows : list of list of object
        Rows with one cell per header.
    places : list of str
        Name of each row in messages.
    decimal_point : bool
        Whether a point is always a decimal point.
    merged : frozenset of (int, int)
        Row and column of merged cells.
    notes : list of str
        Remarks on what was left out.
    """

    source: str
    headers: list[Header]
    rows: list[list[Cell]]
    places: list[str]
    decimal_point: bool
    merged: frozenset[tuple[int, int]]
    notes: list[str] = field(default_factory=list)

    def error(self, message: str, row: int | None = None, column: int | None = None) -> InputError:
        """Return an error with its place in the table."""
        parts = [] if row is None else [self.places[row]]
        parts += [] if column is None else [f"column {self.headers[column].text!r}"]
        return InputError(message, ", ".join(parts), self.source)


def table_of(grid: Grid, kind: Kind, mapped: frozenset[str] = frozenset()) -> Table:
    """Return the table in a grid.

    Parameters
    ----------
    grid : Grid
    kind : {"agents", "tasks", "distances"}
    mapped : frozenset of str
        Names of columns specified by the user.

    Raises
    ------
    InputError
        If it has no header, no rows, or a row that is longer than the header.
    """
    filled = [row for row, cells in enumerate(grid.rows) if any(cell is not None for cell in cells)]
    if not filled:
        raise InputError("is empty; it needs a row with the names of its columns, and rows below", source=grid.source)
    top = 0 if grid.has_header else _header_row(grid, filled[:SEARCHED], kind, mapped)
    header = _names(grid, top)
    width = max((column + 1 for column, name in enumerate(header) if name), default=0)
    headers = [header_of(name, kind) for name in header[:width]]
    body = [row for row in filled if row > top]
    if body and not grid.has_header and _are_units(grid.rows[body[0]]):
        units = [*grid.rows[body.pop(0)], *[None] * width]
        headers = [_with_unit(one, units[column]) for column, one in enumerate(headers)]
    notes = list(grid.notes)
    body = _body(grid, body, header, notes)
    if not body:
        raise InputError("has no rows below the names of its columns", source=grid.source)
    for row in body:
        if any(cell is not None for cell in grid.rows[row][width:]):
            count = max(column + 1 for column, cell in enumerate(grid.rows[row]) if cell is not None)
            raise InputError(
                f"has {count} cells, but there are names for {width} columns; name each column, and put numbers with "
                "decimal commas into quotes",
                grid.places[row],
                grid.source,
            )
    number = {row: index for index, row in enumerate(body)}
    return Table(
        grid.source,
        headers,
        [[*grid.rows[row][:width], *[None] * (width - len(grid.rows[row]))] for row in body],
        [grid.places[row] for row in body],
        grid.decimal_point,
        frozenset((number[row], column) for row, column in grid.merged if row in number),
        notes,
    )


def _header_row(grid: Grid, rows: list[int], kind: Kind, mapped: frozenset[str]) -> int:
    """Return the row without numbers that has most names of known columns; of equals, the first fullest one."""
    scores: dict[int, tuple[int, int]] = {}
    for row in rows:
        texts = _names(grid, row)
        if any(_is_number(cell) for cell in grid.rows[row]) and not (kind == "distances" and row == rows[0]):
            continue
        known = sum(bool(header_of(text, kind).ranks) or text in mapped for text in texts if text)
        scores[row] = (known, sum(bool(text) for text in texts))
    if rows[0] not in scores and not any(known for known, _ in scores.values()):
        raise InputError(
            "has no names of columns; write them into the first row, such as id, x, y",
            grid.places[rows[0]],
            grid.source,
        )
    best = max(scores, key=lambda row: (*scores[row], -row))
    return best if scores[best][0] else rows[0]


def _names(grid: Grid, row: int) -> list[str]:
    """Return the names of columns in a row, combined with the row above for cells that are empty or units."""
    texts = [as_name(cell) for cell in grid.rows[row]]
    above = [as_name(cell) for cell in grid.rows[row - 1]] if row else []
    if sum(map(bool, above)) < 2 or any(map(_is_number, grid.rows[row - 1])):
        return texts
    return [_joined(upper, lower) for upper, lower in zip_longest(above, texts, fillvalue="")]


def _joined(upper: str, lower: str) -> str:
    """Return the name of a column from two header rows: the lower cell, or the upper one with its unit."""
    if upper and lower and upper != lower and measure_of(lower.strip("[]()")) is not None:
        return upper if _ends_in(upper, lower) else f"{upper} [{lower.strip('[]()')}]"
    return lower or upper


def _ends_in(name: str, unit: str) -> bool:
    """Return whether the name of a column already ends with the unit in the cell below it."""
    return measure_of(re.split(r"[\s\[(]", name.rstrip(")] "))[-1]) == measure_of(unit.strip("[]() "))


def _is_number(cell: Cell) -> bool:
    return is_real(cell) or (isinstance(cell, str) and (split_number(cell) or ("", "-"))[1] == "")


def _are_units(cells: list[Cell]) -> bool:
    """Return whether a row contains only units, with or without brackets."""
    texts = [cell for cell in cells if isinstance(cell, str) and not is_absent(cell)]
    if not texts or any(cell is not None and not isinstance(cell, str) for cell in cells):
        return False
    return all(measure_of(text.strip("[]()")) is not None for text in texts)


def _with_unit(header: Header, unit: Cell) -> Header:
    if not isinstance(unit, str) or is_absent(unit) or _ends_in(header.text, unit):
        return header
    return Header(
        f"{header.text} [{as_text(unit).strip('[]()')}]", header.ranks, measure_of(as_text(unit).strip("[]()"))
    )


def _body(grid: Grid, body: list[int], header: list[str], notes: list[str]) -> list[int]:
    """Return the rows without repeated headers, and without totals and footnotes at the end; add them to `notes`."""
    repeated = [row for row in body if [as_name(cell) for cell in grid.rows[row]] == header]
    notes += [f"{grid.places[row]} repeats the names of the columns and is left out" for row in repeated]
    body = [row for row in body if row not in set(repeated)]
    dropped: list[str] = []
    while len(body) > 1:
        row = body[-1]
        cells = [cell for cell in grid.rows[row] if cell is not None]
        first = cells[0]
        is_total = isinstance(first, str) and _is_total(first)
        is_remark = len(cells) == 1 and not _is_number(first) and row > body[-2] + 1
        if not is_total and not is_remark:
            break
        dropped.append(f"{grid.places[row]} is a {'total' if is_total else 'remark'} ({shown(first)}) and is left out")
        body.pop()
    notes += reversed(dropped)
    return body


def _is_total(text: str) -> bool:
    name = plain(text)
    return name in TOTALS or text.strip(" :.") in TOTALS
