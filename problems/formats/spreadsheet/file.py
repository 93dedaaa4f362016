"""Reading of the cells of a file; its suffix determines whether it is text or a workbook."""

import os
import re
from pathlib import Path

from alloc.problems.errors import InputError
from alloc.problems.formats.files import PathLike, is_stream, named, read_bytes
from alloc.problems.formats.messages import told
from alloc.problems.formats.spreadsheet.delimited import grid_of_text
from alloc.problems.tables.grid import Grid

SHEET = re.compile(r"^(.+\.xls[xm]):(.+)$", re.IGNORECASE | re.DOTALL)
WORKBOOKS = (".xlsx", ".xlsm")
OTHERS = (".xls", ".xlsb", ".ods", ".numbers", ".pdf", ".doc", ".docx")


def read_grid(path: PathLike) -> Grid:
    """Return the cells of a table.

    Parameters
    ----------
    path : str or path
        ``*.xlsx`` or ``*.xlsm``, the first sheet or ``file.xlsx:Sheet``; otherwise delimited text, ``-`` for text
        from standard input.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    source = named(path)
    match = SHEET.match(os.fspath(path))
    file, sheet = (match[1], match[2]) if match else (os.fspath(path), None)
    try:
        if not is_stream(path):
            suffix = Path(file).suffix.lower()
            if suffix in OTHERS:
                raise InputError(f"tables cannot be read from {suffix}; save it as .xlsx or .csv")
            if suffix in WORKBOOKS:
                from alloc.problems.formats.spreadsheet.workbook import grid_of_workbook

                return grid_of_workbook(read_bytes(file), source, sheet)
        return grid_of_text(read_bytes(file), source)
    except InputError as error:
        raise told(error, source) from error.__cause__
