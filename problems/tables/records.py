"""Parsing of a table of agents, tasks or bases into fields."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from alloc.problems.arguments import shown
from alloc.problems.errors import InputError
from alloc.problems.fields import FloatArray
from alloc.problems.tables.charge import charged
from alloc.problems.tables.conversion import DIMENSIONS, Found
from alloc.problems.tables.grid import as_name
from alloc.problems.tables.language.digits import Mark
from alloc.problems.tables.language.measures import proportion
from alloc.problems.tables.layout import Table
from alloc.problems.tables.matching import Match
from alloc.problems.tables.numeric import Numbers, require_numbers
from alloc.problems.tables.values import coordinates, flag, names_in

NUMERIC = frozenset(
    ("ability", "workload", "battery", "range", "speed", "energy_per_distance", "priority", "x", "y", "z", "lat", "lon")
)
REQUIRED: dict[str, str | None] = {"agents": "ability", "tasks": "workload", "bases": None}
HALF_TURN = 180.0
"""Degrees."""

EXAMPLES = {
    "agents": "ability=Capacity, or ability=1 for all alike",
    "tasks": "workload=Demand, or workload=1 for all alike",
}


@dataclass
class Records:
    """Parsed rows of a table.

    Attributes
    ----------
    match : Match
    ids : list of str, or None
        Ids; None without a column of ids.
    numbers : dict of str to ndarray
        Numbers by field, in the units of the table; NaN for empty cells.
    found : list of Found
        Units of the columns.
    geographic : bool or None
        Whether places are latitude and longitude; None without places.
    notes : list of str
        Remarks on rows without ids.
    conversions : dict of str to str
        Descriptions of conversions of units, by field.
    """

    match: Match
    ids: list[str] | None
    numbers: dict[str, FloatArray]
    found: list[Found]
    geographic: bool | None
    notes: list[str] = field(default_factory=list)
    conversions: dict[str, str] = field(default_factory=dict)

    @property
    def table(self) -> Table:
        """The original table."""
        return self.match.table

    def homes(self, bases: Sequence[str]) -> list[bool | str] | None:
        """Return the base of each row, or whether it returns at all; None without such a column."""
        if "returns" not in self.match.columns:
            return None
        column = self.match.columns["returns"]
        names = [as_name(cell) for cell in self.match.cells("returns")]
        return [name if name in bases else flag(self.table, row, column) for row, name in enumerate(names)]

    def lists(self, name: str, marks: str) -> list[list[str]] | None:
        """Return the lists of names of a field; None without such a column."""
        if name not in self.match.columns:
            return None
        return [names_in(cell, marks) for cell in self.match.cells(name)]

    def positions(self) -> FloatArray | None:
        """Return positions, shape (count, 3), with longitude before latitude, as in an instance."""
        if self.geographic is None:
            return None
        first, second = ("lon", "lat") if self.geographic else ("x", "y")
        height = self.numbers.get("z", np.zeros(len(self.table.rows)))
        place = np.column_stack([self.numbers[first], self.numbers[second], np.nan_to_num(height)])
        self._check_places(place)
        if self.geographic:
            place[place[:, 0] > HALF_TURN, 0] -= 2 * HALF_TURN
        place[np.isnan(place[:, 0])] = np.nan
        return place

    def _check_places(self, place: FloatArray) -> None:
        half = np.isnan(place[:, 0]) != np.isnan(place[:, 1])
        if half.any():
            raise self.table.error("has one coordinate without the other; fill in both or none", int(np.argmax(half)))
        wrong = np.zeros(1, dtype=bool)
        if self.geographic:
            wrong = (np.abs(place[:, 1]) > 90) | (place[:, 0] < -HALF_TURN) | (place[:, 0] > 2 * HALF_TURN)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise self.table.error(
                f"latitude {place[row, 1]:g} and longitude {place[row, 0]:g} are not on earth; swapped, or x and y?",
                row,
            )


def records_of(match: Match, decimal: Mark | None, *, is_percent: bool = False) -> Records:
    """Return the rows of a table of agents, tasks or bases; `is_percent` says whether energies are in percent.

    Raises
    ------
    InputError
        If a cell cannot be read, an id is repeated, or a required value is missing.
    """
    table, required = match.table, REQUIRED[match.kind]
    if required is not None and required not in match.columns and required not in match.constants:
        names = ", ".join(repr(header.text) for header in table.headers if header.text)
        names += f"; specify it by --map {EXAMPLES[match.kind]}"
        raise table.error(f"no column is recognised as the {required}; the columns are {names}")
    columns = {name: column for name, column in match.columns.items() if name in NUMERIC}
    reader, numbers, found = Numbers(table, columns, decimal), dict[str, FloatArray](), list[Found]()
    for name, column in columns.items():
        numbers[name], measure = reader.read(name)
        if name in DIMENSIONS:
            found.append(Found(table.source, table.headers[column].text, name, measure))
    for name, value in match.constants.items():
        numbers[name] = np.full(len(table.rows), value)
    if required is not None:
        require_numbers(table, match.columns.get(required), required, numbers[required])
    numbers |= _combined(match)
    found += _unit_of_position(match)
    records = Records(match, None, numbers, found, _is_geographic(numbers))
    records.ids = _ids(match, None if required is None else numbers[required], records.notes)
    _metres(records)
    _west(records)
    share = charged(match, numbers, found, decimal, is_percent=is_percent)
    records.notes += [share] if share else []
    return records


def _west(records: Records) -> None:
    """Add a note that longitudes above 180 are interpreted as west."""
    if not records.geographic or not (records.numbers["lon"] > HALF_TURN).any():
        return
    east = float(records.numbers["lon"][np.argmax(records.numbers["lon"] > HALF_TURN)])
    records.notes.append(f"longitudes beyond 180 are west: {east:g} is {east - 2 * HALF_TURN:g}")


def _is_geographic(numbers: dict[str, FloatArray]) -> bool | None:
    return True if "lat" in numbers else False if "x" in numbers else None


def _metres(records: Records) -> None:
    """Convert altitudes of geographic places to metres, and exclude them from the common unit of distance."""
    if not records.geographic:
        return
    for one in [one for one in records.found if one.field == "z"]:
        records.found.remove(one)
        factor = 1.0 if one.measure is None else proportion(one.measure.top, "m")
        if factor is None or (one.measure is not None and one.measure.bottom):
            raise InputError(f"is in {one.measure}, which is not a height", f"column {one.header!r}", one.source)
        if factor != 1:
            records.numbers["z"] = records.numbers["z"] * factor
            records.conversions["z"] = f" in m, times {factor:g}"


def _combined(match: Match) -> dict[str, FloatArray]:
    """Return the coordinates in a single column."""
    name = next((name for name in ("gps", "lonlat", "position") if name in match.columns), None)
    if name is None:
        return {}
    column, table = match.columns[name], match.table
    values = np.full((len(table.rows), 3), np.nan)
    for row, cell in enumerate(match.cells(name)):
        place = None if cell is None else coordinates(cell)
        if cell is not None and place is None:
            raise table.error(f"must be two or three coordinates, got {shown(cell)}", row, column)
        if place is not None:
            values[row] = [*place, 0.0][:3]
    order = {"gps": ("lat", "lon"), "lonlat": ("lon", "lat"), "position": ("x", "y")}[name]
    return {order[0]: values[:, 0], order[1]: values[:, 1], "z": np.nan_to_num(values[:, 2])}


def _unit_of_position(match: Match) -> list[Found]:
    """Return the unit of x, y and z in a single column."""
    if "position" not in match.columns:
        return []
    header = match.table.headers[match.columns["position"]]
    return [Found(match.table.source, header.text, axis, header.measure) for axis in "xyz"]


def _ids(match: Match, required: FloatArray | None, notes: list[str]) -> list[str] | None:
    """Return the ids of the rows; rows without an id get one, with a remark in `notes`."""
    table = match.table
    letter = match.kind[0]
    if "id" not in match.columns:
        notes.append(f"there is no column of ids: the {match.kind} are {letter}1 to {letter}{len(table.rows)}")
        return None
    column = match.columns["id"]
    ids = [as_name(cell) for cell in match.cells("id")]
    if required is not None:
        _refuse_unnamed_sum(table, ids, required)
    first: dict[str, int] = {}
    for row, name in enumerate(ids):
        if name and name in first:
            raise table.error(f"{name!r} is also the id in {table.places[first[name]]}; rename one", row, column)
        first[name] = row
    for row, name in enumerate(ids):
        if not name:
            ids[row] = _free(f"{letter}{row + 1}", first)
            first[ids[row]] = row
            notes.append(f"{table.places[row]} has no id and is named {ids[row]}")
    return ids


def _free(name: str, taken: dict[str, int]) -> str:
    while name in taken:
        name += "'"
    return name


def _refuse_unnamed_sum(table: Table, ids: list[str], required: FloatArray) -> None:
    """Raise an error for a last row without an id whose number is the sum of those above, as it may be a total."""
    if len(ids) > 2 and not ids[-1] and all(ids[:-1]) and np.isclose(required[-1], required[:-1].sum(), rtol=1e-9):
        raise table.error(
            "has no id and looks like the sum of the rows above; call it 'Total', or give it an id", len(ids) - 1
        )
