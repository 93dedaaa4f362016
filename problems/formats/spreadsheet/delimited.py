"""Delimited text, in the encodings and with the separators that spreadsheets write."""

import codecs
import csv
import io
import re
from collections import Counter

from alloc.problems.errors import InputError
from alloc.problems.tables.grid import Grid, clean

SEPARATORS = ("\t", ";", ",", "|")
"""Separators, in order of preference if several fit."""

MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
DECLARED = re.compile(r"^\"?sep=(.)\"?\r?\n", re.IGNORECASE)
FORMULA_TEXT = re.compile(r'^="([^"]*)"$')
SAMPLE = 200
"""Number of rows from which the separator is determined."""


def grid_of_text(data: bytes, source: str) -> Grid:
    """Return the cells of a text file, detecting its encoding and separator.

    Raises
    ------
    InputError
        If it is not text, or its quotes are unbalanced.
    """
    text, encoding = decoded(data)
    if text.lstrip().startswith(("<", "{")):
        raise InputError("is HTML, XML or JSON, not a table; save it as .csv or .xlsx")
    notes = [] if encoding.startswith("utf") else [f"is not UTF-8 and was read as {encoding}"]
    declared = DECLARED.match(text)
    first = 0
    if declared:
        text, first = text[declared.end() :], 1
    separator = declared[1] if declared else separator_of(text)
    rows: list[list[object]] = []
    places: list[str] = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, strict=True, skipinitialspace=True)
    line = 1
    try:
        for row in reader:
            rows.append([clean(_unescaped(cell)) for cell in row])
            places.append(f"line {first + line}")
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(
            f"has a cell that cannot be read: {error}; are its quotes balanced?", f"line {line}"
        ) from error
    return Grid(source, rows, places, decimal_point=separator == ",", notes=tuple(notes))


def _unescaped(cell: str) -> str:
    """Return the text of a cell written as a formula, which prevents spreadsheets from converting it to a number."""
    return FORMULA_TEXT.sub(r"\1", cell) if cell.startswith('="') else cell


def decoded(data: bytes) -> tuple[str, str]:
    """Return a text and its encoding: by byte order mark, UTF-16 by its zero bytes, UTF-8, or else Windows-1252."""
    for mark, encoding in MARKS:
        if data.startswith(mark):
            return _decode(data[len(mark) :], encoding), encoding
    head = data[:2000]
    if head.count(0) > len(head) // 4:
        encoding = "utf-16-le" if head[1::2].count(0) > head[::2].count(0) else "utf-16-be"
        return _decode(data, encoding), encoding
    if b"\0" in data:
        raise InputError("is not text; save it as .csv or .xlsx")
    for encoding in ("utf-8", "Windows-1252"):
        try:
            return data.decode(encoding), encoding
        except UnicodeDecodeError:
            continue
    return data.decode("latin-1"), "Latin-1"


def _decode(data: bytes, encoding: str) -> str:
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        raise InputError(f"begins like {encoding.upper()}, but is not valid; save it as UTF-8") from error


def separator_of(text: str) -> str:
    """Return the separator that gives most rows the same number of cells, at least 2; a comma for a single column."""
    best, score = ",", (0, 0)
    for separator in SEPARATORS:
        try:
            reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
            counts = Counter(len(row) for row, _ in zip(reader, range(SAMPLE), strict=False) if any(row))
        except csv.Error:
            continue
        counts.pop(1, None)
        if counts:
            width, rows = max(counts.items(), key=lambda item: (item[1], item[0]))
            if (rows, width) > score and (rows > score[0] or separator != ","):
                best, score = separator, (rows, width)
    return best
