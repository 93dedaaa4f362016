"""Reading of Excel workbooks by openpyxl."""

import io
import zipfile
from typing import TYPE_CHECKING

from alloc.problems.errors import InputError, MissingPackageError, nearest
from alloc.problems.tables.grid import Cell, Grid, clean

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

OPENPYXL_MISSING = "needs openpyxl; install it with: pip install 'alloc-mrta[tables]', or save the sheet as .csv"


def grid_of_workbook(data: bytes, source: str, sheet: str | None) -> Grid:
    """Return the cells of a sheet, by default the first; merged cells have their value in each row.

    Raises
    ------
    MissingPackageError
        If openpyxl is not installed.
    InputError
        If it is not a workbook, or has no such sheet.
    """
    try:
        import openpyxl
        from openpyxl.utils.exceptions import InvalidFileException
    except ImportError as error:
        raise MissingPackageError(OPENPYXL_MISSING, source=source) from error
    try:
        book = openpyxl.load_workbook(io.BytesIO(data), data_only=True)
    except (InvalidFileException, zipfile.BadZipFile, KeyError, ValueError) as error:
        raise InputError("is not a readable workbook (protected by a password?); save it again, or as .csv") from error
    names = [one.title for one in book.worksheets]
    if not names:
        raise InputError("has no sheet with cells")
    if sheet is not None and sheet not in names:
        raise InputError(f"has no sheet {sheet!r}{nearest(sheet, names)}")
    notes = [f"the first of {len(names)} sheets, {names[0]!r}, was read"] if sheet is None and len(names) > 1 else []
    return _grid(book[sheet or names[0]], source, notes)


def _grid(sheet: "Worksheet", source: str, notes: list[str]) -> Grid:
    rows: list[list[Cell]] = [
        [clean(value) for value in row] for row in sheet.iter_rows(min_col=1, min_row=1, values_only=True)
    ]
    merged: set[tuple[int, int]] = set()
    for block in sheet.merged_cells.ranges:
        top, left = block.min_row - 1, block.min_col - 1
        for row in range(top + 1, min(block.max_row, len(rows))):
            rows[row][left] = rows[top][left]
            merged |= {(top, left), (row, left)} if rows[top][left] is not None else set()
    hidden = [number for number, shape in sheet.row_dimensions.items() if shape.hidden and number <= len(rows)]
    if hidden:
        notes.append(f"{len(hidden)} hidden rows were read too")
    places = [f"row {number}" for number in range(1, len(rows) + 1)]
    return Grid(source, rows, places, merged=frozenset(merged), notes=tuple(notes))
