"""Forest fires in New Brunswick, `nbfires` of the R package spatstat.data, as a table."""

from datetime import datetime, timedelta

from alloc.problems.formats.spreadsheet import read_grid
from alloc.problems.missions.readers.cells import Table
from alloc.problems.missions.readers.options import RecordOptions
from alloc.problems.missions.readers.records import Record, Records
from alloc.problems.text import counted

COLUMNS = {"x": "x", "y": "y", "year": "year", "day": "dis.julian", "when": "dis.date", "size": "fnl.size"}

KM = 0.403716
"""Kilometres per unit of length in `nbfires`."""

SPEED_KM_H = 60.0
"""Speed of a crew on the road; not part of the records."""

MIN_HA = 0.1
"""Minimum workload, also for fires without a recorded size."""


def read_new_brunswick(path: str, options: RecordOptions) -> Records:
    """Read fires: place, day of discovery, and final size as the workload.

    Parameters
    ----------
    path : str
        Output of ``write.csv(as.data.frame(nbfires), "nbfires.csv")`` in R.
    options : RecordOptions

    Raises
    ------
    InputError
        If the file cannot be read, or lacks a column.
    """
    table = Table(read_grid(path), COLUMNS, optional=["year", "day", "when"])
    found = Records(table.source, "ha", SPEED_KM_H)
    lost = 0
    for row in table.rows:
        when, x, y = _discovered(table, row), table.number(row, "x"), table.number(row, "y")
        if when is None or x is None or y is None:
            lost += 1
            continue
        work = max(MIN_HA, table.number(row, "size") or 0.0)
        found.records.append(Record(f"fire{row}", when, (x * KM, y * KM), work))
    if lost:
        found.notes.append(f"{counted(lost, 'fire')} without a place or a day left out")
    return found


def _discovered(table: Table, row: int) -> datetime | None:
    """Return the day of discovery, given as a date or as a day of the year."""
    when = table.hour(row, "when")
    if when is not None:
        return when
    year, day = table.number(row, "year"), table.number(row, "day")
    if year is None or day is None:
        return None
    if not (1 <= year <= 9999 and 1 <= day <= 366):
        raise table.error(f"must be a day of a year, got {day:g} of {year:g}", row, "day")
    return datetime(int(year), 1, 1) + timedelta(days=day - 1)
