"""Parsing of columns of numbers, with units in headers and cells."""

import re
from collections.abc import Mapping

import numpy as np

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.tables.grid import Cell, is_real
from alloc.problems.tables.language.digits import Mark, decimal_marks, is_absent, mark_of, number_of, split_number
from alloc.problems.tables.language.measures import Measure, measure_of, own_measure, rate_of
from alloc.problems.tables.language.synonyms import FIRST_IS_HIGHEST, LEVELS
from alloc.problems.tables.layout import Table
from alloc.problems.tables.values import angle

ANGLES = ("lat", "lon")
OTHER_SIDES = {"lat": "[EWew]", "lon": "[NSns]"}
"""Compass directions that belong to the other coordinate."""

NO_UNIT = ("priority", "x", "y", "z")
"""Fields for which unknown text in brackets is a remark, such as a scale or a projection, not a unit."""

WORK = ("ability", "workload")
"""Fields whose unit may be any word, and whose merged cells are ambiguous: the sum, or each value."""


class Numbers:
    """Parser of the numbers of a table, which determines the decimal mark from all of them.

    Parameters
    ----------
    table : Table
    columns : dict of str to int
        Columns with numbers, by field.
    decimal : {",", "."}, optional
        The decimal mark, if specified by the user.
    """

    def __init__(self, table: Table, columns: Mapping[str, int], decimal: Mark | None) -> None:
        self._table, self._columns, self._decimal = table, columns, decimal
        self._digits = {column: _digits(table, column) for column in columns.values()}
        self._shown = decimal_marks(digits for column in self._digits.values() for digits in column)

    def read(self, name: str) -> tuple[FloatArray, Measure | None]:
        """Return the numbers of a field, NaN for empty cells, and their unit.

        Raises
        ------
        InputError
            If a cell is not a number, or is ambiguous.
        """
        column = self._columns[name]
        if name == "priority" and re.search(FIRST_IS_HIGHEST, self._table.headers[column].text, re.IGNORECASE):
            raise self._table.error(
                "counts from 1, the most urgent, but here larger is more urgent; reverse it", column=column
            )
        mark = self._mark(name, column)
        values = np.full(len(self._table.rows), np.nan)
        units: dict[str, int] = {}
        for row, cells in enumerate(self._table.rows):
            value, unit = self._number(name, cells[column], mark, row)
            values[row] = value
            if unit and not np.isnan(value):
                units.setdefault(unit, row)
            if name in WORK and (row, column) in self._table.merged:
                raise self._table.error("is merged: one value for each or for all? Unmerge the cells", row, column)
        return values, self._measure(name, column, units)

    def _mark(self, name: str, column: int) -> Mark:
        """Return the decimal mark of a column, by its own numbers, or else by those of the whole table."""
        if self._decimal is not None:
            return self._decimal
        digits = self._digits[column]
        own = decimal_marks(digits)
        unclear = [one for one in digits if mark_of(one).startswith("?")]
        if len(own) == 2:
            raise self._table.error("has decimal commas and decimal points; use one of them", column=column)
        if own or not unclear:
            return next(iter(own), ".")
        if name in ANGLES:
            return "," if "," in unclear[0] else "."  # degrees are never in the thousands
        if len(self._shown) == 1:
            return next(iter(self._shown))
        has_whole = any(mark_of(one) == "" for one in digits)  # then three digits after a mark may be thousands
        if self._table.decimal_point and not has_whole and not any("," in one for one in unclear):
            return "."
        raise self._unclear(unclear, column)

    def _unclear(self, unclear: list[str], column: int) -> InputError:
        """Return the error for an ambiguous number."""
        row = next(row for row, cells in enumerate(self._table.rows) if str(cells[column]).startswith(unclear[0]))
        as_decimal, as_group = unclear[0].replace(",", "."), unclear[0].replace(",", "").replace(".", "")
        choice = "comma or --decimal point" if "," in unclear[0] else "point or --decimal comma"
        return self._table.error(
            f"{unclear[0]!r} may be {as_decimal} or {as_group}; specify it by --decimal {choice}", row, column
        )

    def _number(self, name: str, cell: Cell, mark: Mark, row: int) -> tuple[float, str]:
        """Return the value of a cell, and the unit after it."""
        if cell is None or (isinstance(cell, str) and is_absent(cell)):
            return np.nan, ""
        if is_real(cell):
            return (np.nan if np.isinf(cell) else float(cell)), ""
        column = self._columns[name]
        if not isinstance(cell, str):
            what = f"is a date ({cell})" if hasattr(cell, "isoformat") else f"must be a number, got {shown(cell)}"
            raise self._table.error(f"{what}; write a number, in a cell formatted as a number", row, column)
        if cell.startswith("#"):
            raise self._table.error(f"contains the error {cell!r} of a formula; correct it", row, column)
        if name == "priority" and cell.casefold() in LEVELS:
            return LEVELS[cell.casefold()], ""
        parts = split_number(cell)
        if parts is not None and mark_of(parts[0]) != "!" and (not parts[1] or self._is_unit(name, parts[1])):
            return self._value(parts[0], mark, row, column), parts[1]
        degrees = angle(cell) if name in ANGLES and not re.search(OTHER_SIDES[name], cell) else None
        if degrees is not None:
            return degrees, ""
        header = self._table.headers[column].text
        guess = "" if header.casefold() == name else f"; if this is not the {name}, specify it by --map {name}=COLUMN"
        raise self._table.error(f"must be a number, got {shown(cell)}{guess}", row, column)

    def _value(self, digits: str, mark: Mark, row: int, column: int) -> float:
        shown_mark = mark_of(digits)
        if shown_mark in (",", ".") and shown_mark != mark:
            other = "comma" if mark == "," else "point"
            raise self._table.error(f"must be a number with a decimal {other}, got {digits!r}", row, column)
        return number_of(digits, mark)

    def _is_unit(self, name: str, text: str) -> bool:
        if name in ANGLES:
            return text in ("°", "deg")
        return measure_of(text) is not None or (name in WORK and text.replace("/", "").isalpha())

    def _measure(self, name: str, column: int, units: Mapping[str, int]) -> Measure | None:
        """Return the unit of a column, after checking that its header and cells agree."""
        if name in ANGLES:
            return None
        header = self._table.headers[column]
        measure = header.measure
        if measure is None and name not in NO_UNIT and header.label and ("[" in header.text or "/" in header.label):
            measure = rate_of(header.label) if name in WORK else own_measure(header.label)
        for unit, row in units.items():
            found = measure_of(unit) or rate_of(unit)
            if measure is not None and found != measure:
                raise self._table.error(f"is in {unit}, others are in {measure}; use one unit", row, column)
            measure = found
        return measure


def _digits(table: Table, column: int) -> list[str]:
    """Return the digits of those texts in a column that are numbers."""
    texts = [cell for cell in (row[column] for row in table.rows) if isinstance(cell, str)]
    return [parts[0] for parts in map(split_number, texts) if parts is not None]


def require_numbers(table: Table, column: int | None, name: str, values: FloatArray) -> None:
    """Raise `InputError` if a required number is missing in a row."""
    absent = np.isnan(values)
    if absent.any():
        raise table.error(f"has no {name}; fill it in, or leave the row out", int(np.argmax(absent)), column)
