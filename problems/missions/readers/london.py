"""Animal rescues of the London Fire Brigade, as published by the London Datastore and TidyTuesday."""

from alloc.problems.errors import InputError
from alloc.problems.formats.spreadsheet import read_grid
from alloc.problems.missions.readers.cells import Table
from alloc.problems.missions.readers.options import RecordOptions
from alloc.problems.missions.readers.records import Record, Records
from alloc.problems.text import counted

COLUMNS = {
    "id": "IncidentNumber",
    "when": "DateTimeOfCall",
    "hours": "PumpHoursTotal",
    "x": "Easting_rounded",
    "y": "Northing_rounded",
    "station": "stngroundname",  # case and punctuation do not matter
}
FLEET = {"id": "Fleet No", "status": "Operational Status", "kind": "Type of Vehicle"}

SPEED_KM_H = 30.0
"""Speed of a vehicle in town; not part of the records."""

USUAL_HOURS = 1.0
"""Pump hours assumed for calls without; nearly all calls have this value."""


def read_london(path: str, options: RecordOptions) -> Records:
    """Read calls: place to within 50 m, hour, and pump hours as the workload.

    Parameters
    ----------
    path : str
    options : RecordOptions
        With the file of the fleet, if there is one.

    Raises
    ------
    InputError
        If a file cannot be read, or lacks a column.
    """
    table = Table(read_grid(path), COLUMNS, optional=["station"])
    found = Records(table.source, "pump hours", SPEED_KM_H)
    lost = filled = 0
    for row in table.rows:
        when, x, y = table.hour(row, "when"), table.number(row, "x"), table.number(row, "y")
        if when is None or x is None or y is None:
            lost += 1
            continue
        hours = table.number(row, "hours")
        if hours is not None and hours < 0:
            raise table.error(f"must be >= 0, got {hours:g}", row, "hours")
        filled += hours is None
        name = table.text(row, "id") or f"row{row}"
        place, work = (x / 1000, y / 1000), USUAL_HOURS if hours is None else hours
        found.records.append(Record(name, when, place, work, table.text(row, "station")))
    if lost:
        found.notes.append(f"{counted(lost, 'call')} without a place or an hour left out")
    if filled:
        found.notes.append(f"{counted(filled, 'call')} without pump hours set to {USUAL_HOURS:g}")
    if options.fleet is not None:
        found.vehicles = _vehicles(options.fleet)
    return found


def _vehicles(path: str) -> list[str]:
    """Return the pumping appliances in service."""
    table = Table(read_grid(path), FLEET)
    vehicles = [
        table.text(row, "id")
        for row in table.rows
        if table.text(row, "status").upper() == "ACTIVE" and "pumping" in table.text(row, "kind").lower()
    ]
    if not vehicles:
        raise InputError("has no pumping appliance whose status is ACTIVE", source=table.source)
    return list(dict.fromkeys(vehicles))
