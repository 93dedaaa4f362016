"""Matching of columns with fields, specified by the user or recognised by an unambiguous header."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from alloc.problems.errors import InputError, nearest
from alloc.problems.tables.grid import Cell
from alloc.problems.tables.language.headers import Kind, plain
from alloc.problems.tables.language.synonyms import UNCLEAR_PLACES
from alloc.problems.tables.layout import Table
from alloc.problems.tables.values import coordinates

WORDS = {
    "gps": "latitude and longitude",
    "lonlat": "longitude and latitude",
    "position": "x and y",
    "energy_per_distance": "energy per distance",
    "start_task": "start task",
}
"""Names of fields in messages, if they differ from the field."""

REMARKS = {"priority": " (larger is more urgent)"}
"""Additional remarks on columns whose convention varies."""

TEXTS = ("id", "start_task", "tasks", "skills", "needs", "returns", "gps", "lonlat", "position", "from", "to")
"""Fields that cannot be given as a constant."""

FAMILIES = (("x", "y"), ("lat", "lon"), ("gps",), ("lonlat",), ("position",))
"""Alternative sets of columns for places."""


@dataclass
class Match:
    """Columns of a table by field.

    Attributes
    ----------
    table : Table
    kind : {"agents", "tasks", "distances"}
    columns : dict of str to int
    constants : dict of str to float
        Values for all rows, as given by ``ability=1``.
    """

    table: Table
    kind: Kind
    columns: dict[str, int]
    constants: dict[str, float] = field(default_factory=dict)

    def cells(self, name: str) -> list[Cell]:
        """Return the cells of a field."""
        return [row[self.columns[name]] for row in self.table.rows]

    def guesses(self, conversions: Mapping[str, str]) -> list[str]:
        """Return a line for each column with its interpretation; `conversions` describes conversions of units."""
        fields = {column: name for name, column in self.columns.items()}
        lines = [f"{name} = {value:g} for all" for name, value in self.constants.items()]
        for column, header in enumerate(self.table.headers):
            called = header.text or f"column {column + 1}"
            name = fields.get(column)
            if name is not None:
                lines.append(f"{called} -> {name}{conversions.get(name, '')}{REMARKS.get(name, '')}")
            elif header.text or any(row[column] is not None for row in self.table.rows):
                lines.append(f"{called}: ignored")
        return lines


def match_columns(table: Table, kind: Kind, wanted: Mapping[str, str]) -> Match:
    """Return the columns of a table by field.

    Parameters
    ----------
    table : Table
    kind : {"agents", "tasks", "distances"}
    wanted : dict of str to str
        Columns specified by the user, by field.

    Raises
    ------
    InputError
        If a column or a field is ambiguous.
    """
    match = Match(table, kind, {})
    for name, text in wanted.items():
        _take(match, name, text)
    taken = set(match.columns.values())
    candidates: dict[str, list[int]] = {}
    for column in range(len(table.headers)):
        for name in () if column in taken else _readings(match, column):
            candidates.setdefault(name, []).append(column)
    for name, found in candidates.items():
        surest = min(table.headers[column].ranks[name] for column in found)
        best = [column for column in found if table.headers[column].ranks[name] == surest]
        if len(best) > 1:
            raise _ambiguous(table, name, best)
        match.columns[name] = best[0]
    _choose_place(match, wanted)
    _refuse_unclear_places(match)
    return match


def column_named(table: Table, text: str) -> int | None:
    """Return the column with this name, ignoring case or without its unit if necessary; None if there is none."""
    for form in (str, str.strip, str.casefold, plain):
        found = [column for column, header in enumerate(table.headers) if form(header.text) == form(text)]
        if len(found) > 1:
            raise InputError(f"has {len(found)} columns named {text!r}; rename one", source=table.source)
        if found:
            return found[0]
    return None


def _take(match: Match, name: str, text: str) -> None:
    column = column_named(match.table, text)
    if column is not None:
        if column in match.columns.values():
            raise InputError(f"the column {text!r} cannot be two fields at once", source=match.table.source)
        match.columns[name] = column
        return
    try:
        value = float(text)
    except ValueError:
        names = [header.text for header in match.table.headers if header.text]
        raise InputError(f"there is no column {text!r}{nearest(text, names)}", source=match.table.source) from None
    if name in TEXTS:
        raise InputError(f"{name} cannot be {text} for all; name a column", source=match.table.source)
    match.constants[name] = value


def _readings(match: Match, column: int) -> Iterable[str]:
    """Return the fields that a column may be, if any."""
    header = match.table.headers[column]
    given = {*match.columns, *match.constants}
    readings = [name for name in header.ranks if name not in given]
    if len(readings) > 1 and header.measure is not None:
        readings = [name for name in readings if name not in ("id", "priority")]
    if len(readings) > 1:
        what = " or the ".join(WORDS.get(name, name) for name in readings)
        choice = " or ".join(f"--map {name}={_quoted(header.text)}" for name in readings)
        raise match.table.error(f"may be the {what}; specify it by {choice}", column=column)
    return readings


def _ambiguous(table: Table, name: str, columns: list[int]) -> InputError:
    texts = [table.headers[column].text for column in columns]
    what = " and ".join(map(repr, texts))
    return table.error(
        f"columns {what} may each be the {WORDS.get(name, name)}; specify one, as by --map {name}={_quoted(texts[0])}"
        if len(set(texts)) == len(texts)
        else f"there are {len(texts)} columns {texts[0]!r}; rename all but one"
    )


def _quoted(text: str) -> str:
    return f"'{text}'" if " " in text or "[" in text or "(" in text else text


def _refuse_unclear_places(match: Match) -> None:
    """Raise an error for a column of pairs that may or may not be degrees, if no other column gives places."""
    if any(name in match.columns or name in match.constants for family in FAMILIES for name in family):
        return
    for column, header in enumerate(match.table.headers):
        cell = next((row[column] for row in match.table.rows if row[column] is not None), None)
        if plain(header.text) in UNCLEAR_PLACES and coordinates(cell) is not None:
            text = _quoted(header.text)
            raise match.table.error(
                f"may be latitude and longitude, or x and y; specify it by --map gps={text} or --map position={text}",
                column=column,
            )


def _choose_place(match: Match, wanted: Mapping[str, str]) -> None:
    """Keep the set of columns for places that the user specified, or the only one."""
    held = {**match.columns, **match.constants}
    given = [family for family in FAMILIES if any(name in held for name in family)]
    named = [family for family in given if any(name in wanted for name in family)]
    if len(named) == 1:
        for name in [name for family in given if family not in named for name in family]:
            match.columns.pop(name, None)
        given = named
    if len(given) > 1:
        what = " and ".join(repr(_called(match, name)) for family in given for name in family if name in held)
        raise match.table.error(f"columns {what} give places in two ways; specify one, as by --map {given[0][0]}=...")
    for family in given:
        for name in family:
            if name not in held:
                other = _called(match, next(one for one in family if one in held))
                raise match.table.error(f"{other!r} is there, but no column for {name}; add it, or --map {name}=COLUMN")


def _called(match: Match, name: str) -> str:
    """Return the header of the column of a field, or the name of a field that is constant."""
    return match.table.headers[match.columns[name]].text if name in match.columns else name
