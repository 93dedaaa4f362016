"""Access to the cells of a third-party table by column name."""

import math
import re
from collections.abc import Mapping, Sequence
from datetime import datetime

from alloc.problems.errors import InputError, nearest
from alloc.problems.tables.grid import Grid, as_text

EMPTY = ("", "NULL", "NA", "None", "NaN")

DATES = ("%d/%m/%Y %H:%M", "%d/%m/%Y %H:%M:%S", "%d/%m/%Y", "%Y-%m-%d", "%Y-%m-%d %H:%M", "%Y-%m-%d %H:%M:%S")
"""Day first, as in both sources, or ISO 8601."""


class Table:
    """A table with column names in its first row; case and punctuation of names do not matter.

    Parameters
    ----------
    grid : Grid
    wanted : mapping of str to str
        Column name in the source, by the name used here.
    optional : sequence of str
        Keys of `wanted` whose columns may be missing.

    Raises
    ------
    InputError
        If a column is missing.
    """

    def __init__(self, grid: Grid, wanted: Mapping[str, str], optional: Sequence[str] = ()) -> None:
        if not grid.rows:
            raise InputError("is empty; it needs a row with the names of the columns", source=grid.source)
        self.source, self._names = grid.source, dict(wanted)
        header = [as_text(cell) for cell in grid.rows[0]]
        known = {_plain(name): column for column, name in enumerate(header)}
        self._columns: dict[str, int] = {}
        for name, column in wanted.items():
            if _plain(column) in known:
                self._columns[name] = known[_plain(column)]
            elif name not in optional:
                raise InputError(f"has no column {column!r}{nearest(column, header)}", grid.places[0], grid.source)
        self.rows = range(1, len(grid.rows))
        self._grid = grid

    def text(self, row: int, name: str) -> str:
        """Return a cell as text, "" if it is empty or missing."""
        column, cells = self._columns.get(name), self._grid.rows[row]
        text = "" if column is None or column >= len(cells) else as_text(cells[column])
        return "" if text in EMPTY else text

    def number(self, row: int, name: str) -> float | None:
        """Return a cell as a number, None if it is empty or missing.

        Raises
        ------
        InputError
            If it is not a finite number.
        """
        text = self.text(row, name)
        if not text:
            return None
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(f"must be a number, got {text!r}", row, name)
        return value

    def hour(self, row: int, name: str) -> datetime | None:
        """Return a cell as date and hour, None if it is empty or missing.

        Raises
        ------
        InputError
            If it is not a date.
        """
        text = self.text(row, name)
        for pattern in DATES if text else ():
            try:
                return datetime.strptime(text, pattern)
            except ValueError:
                continue
        if text:
            raise self.error(f"must be a date such as 31/12/2009 23:59 or 2009-12-31, got {text!r}", row, name)
        return None

    def error(self, message: str, row: int, name: str) -> InputError:
        """Return an error about a cell."""
        return InputError(message, f"{self._grid.places[row]}: {self._names[name]}", self.source)


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())
