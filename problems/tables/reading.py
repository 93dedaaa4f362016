"""Conversion of tables of agents, tasks and distances to arguments of an instance."""

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict, TypeVar

from alloc.problems.distances.given import DistanceTable
from alloc.problems.errors import InputError
from alloc.problems.tables.arguments import Arguments, arguments_of, ids_of
from alloc.problems.tables.conversion import Conversion, conversion
from alloc.problems.tables.grid import Grid, grid_of
from alloc.problems.tables.language.digits import Mark
from alloc.problems.tables.language.headers import Kind
from alloc.problems.tables.layout import table_of
from alloc.problems.tables.matching import column_named, match_columns
from alloc.problems.tables.pairs import Pairs, pairs_of
from alloc.problems.tables.records import Records, records_of
from alloc.problems.tables.wanted import Wanted, is_number
from alloc.problems.units import Units
from alloc.problems.vocabulary import EUCLIDEAN, GEOGRAPHIC

DECIMALS: Mapping[str, Mark] = {"point": ".", "comma": ","}
Built = TypeVar("Built")
ROW = re.compile(r"^(agents|tasks|bases|distances\.rows)\[(\d+)\]")


class TableOptions(TypedDict, total=False):
    """Options of `read_tables`."""

    columns: Mapping[str, str] | None
    units: Units | None
    decimal: str | None
    missing: str | None
    name: str
    report: Callable[[str], object] | None
    bases: object | None


@dataclass(frozen=True)
class Reading:
    """Arguments of an instance read from tables.

    Attributes
    ----------
    arguments : dict
        Arguments of an instance.
    places : dict of str to (str, list of str)
        Source of each table, and names of its rows in messages.
    """

    arguments: Arguments
    places: Mapping[str, tuple[str, list[str]]]

    def built(self, build: Callable[..., Built]) -> Built:
        """Return the instance; errors name the place in the tables."""
        try:
            return build(**self.arguments)
        except InputError as error:
            raise self.located(error) from error

    def located(self, error: InputError) -> InputError:
        """Return an error with its place in the tables."""
        match = ROW.match(error.place)
        if match is None or int(match[2]) >= len(self.places[match[1]][1]):
            return error
        source, rows = self.places[match[1]]
        message = re.sub(r"\brows\[(\d+)\]", lambda other: rows[int(other[1])], error.message)
        return InputError(message, rows[int(match[2])], source)

    def table(self, pairs: Pairs, common: Conversion, missing: str) -> DistanceTable:
        """Return the table of distances in the common unit."""
        factor = common.factors.get((pairs.source, "distance"), 1.0)
        rows = [(source, target, distance * factor) for source, target, distance in pairs.rows]
        ids = self.arguments["agent_ids"], self.arguments["task_ids"]
        try:
            return DistanceTable.of(rows, *ids, missing, self.arguments["bases"].ids)
        except InputError as error:
            raise self.located(error) from error


def read_tables(
    agents: object,
    tasks: object,
    distances: object | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    units: Units | None = None,
    decimal: str | None = None,
    missing: str | None = None,
    name: str = "instance",
    report: Callable[[str], object] | None = None,
    bases: object | None = None,
) -> Reading:
    """Read tables, recognising columns by their names and units.

    Parameters
    ----------
    agents, tasks : DataFrame, dict of columns, list of dicts, or Grid
    distances : the same, optional
        Distances, with columns from, to and distance, or as a matrix.
    columns : dict of str to str, optional
        Column of a field that is not recognised, or a number for all rows, such as ``{"ability": "1"}``;
        ``agents.id`` and ``tasks.id`` apply to one table only.
    units : Units, optional
        Units that are not given in headers.
    decimal : {"point", "comma"}, optional
        The decimal mark, if the numbers leave it open.
    missing : {"metric", "unreachable"}, optional
        Treatment of pairs without a distance; by default ``metric`` if all have places and no pair is marked as
        unreachable.
    name : str
        Name of the instance.
    report : function, optional
        Called with a line on the interpretation of each column, and on each row that was left out; by default, these
        are logged.
    bases : the same as `agents`, optional
        Ids and places of the bases to which agents return.

    Raises
    ------
    InputError
        If a table is ambiguous or cannot be read; the message names the place and the correction.
    """
    if decimal is not None and decimal not in DECIMALS:
        raise InputError(f"must be point or comma, got {decimal!r}", "decimal")
    mark = None if decimal is None else DECIMALS[decimal]
    wanted = Wanted(columns or {})
    first_grid, second_grid = grid_of(agents, "agents"), grid_of(tasks, "tasks")
    if first_grid.source == second_grid.source:
        raise InputError(
            "cannot be both agents and tasks; name a sheet for each, or two files", source=first_grid.source
        )
    is_percent = units is not None and units.energy == "%"
    first = _records(first_grid, "agents", wanted, mark, is_percent=is_percent)
    second = _records(second_grid, "tasks", wanted, mark)
    third = None if bases is None else _records(grid_of(bases, "bases"), "bases", wanted, mark)
    pairs = None
    if distances is not None:
        grid = grid_of(distances, "distances")
        others = [*ids_of(first, "a"), *([] if third is None else ids_of(third, "b"))]
        pairs = pairs_of(grid, others, ids_of(second, "t"), wanted.of("distances", grid), mark)
    wanted.require_all_used()
    placed = [first, second, *([] if third is None else [third])]
    geographic = _geographic(placed)
    found = [one for records in placed for one in records.found] + (pairs.found if pairs else [])
    common = conversion(found, units or Units(), geographic=geographic)
    arguments = arguments_of(first, second, third, common)
    arguments |= {"name": name, "metric": GEOGRAPHIC if geographic else EUCLIDEAN}
    lines = [line for records in placed for line in _lines(records, common)]
    places: dict[str, tuple[str, list[str]]] = {}
    places |= {str(records.match.kind): (records.table.source, records.table.places) for records in placed}
    reading = Reading(arguments, places)
    if pairs is None:
        lines += _unplaced(first, second)
    else:
        rest = missing or _missing(pairs, first, second)
        places["distances.rows"] = (pairs.source, pairs.places)
        arguments["distances"] = reading.table(pairs, common, rest)
        lines += _pair_lines(pairs, common, rest)
    tell = logging.getLogger("alloc").info if report is None else report
    for line in [*lines, *_unmet(arguments)]:
        tell(line)
    return reading


def _records(grid: Grid, kind: Kind, wanted: Wanted, mark: Mark | None, *, is_percent: bool = False) -> Records:
    named = wanted.of(kind, grid)
    table = table_of(grid, kind, frozenset(named.values()))
    for field in [field for field, text in named.items() if column_named(table, text) is None and not is_number(text)]:
        match_columns(table, kind, {field: named[field]})  # raises the error that names the columns
    return records_of(match_columns(table, kind, named), mark, is_percent=is_percent)


def _geographic(placed: Sequence[Records]) -> bool:
    """Return whether places are latitude and longitude; raise an error if tables differ."""
    known = [records for records in placed if records.geographic is not None]
    for records in known[1:]:
        if records.geographic != known[0].geographic:
            told = ["latitude and longitude" if one.geographic else "x and y" for one in (known[0], records)]
            raise InputError(
                f"gives places by {told[1]}, but {known[0].table.source} by {told[0]}; use the same in both",
                source=records.table.source,
            )
    return bool(known and known[0].geographic)


def _missing(pairs: Pairs, first: Records, second: Records) -> str:
    """Return the treatment of pairs without a distance: the metric if all have places and none is unreachable."""
    placed = first.geographic is not None and second.geographic is not None
    return "metric" if placed and not pairs.closed else "unreachable"


def _lines(records: Records, common: Conversion) -> list[str]:
    source = records.table.source
    words = {field: text for (owner, field), text in common.words.items() if owner == source}
    lines = [*records.match.guesses(words | records.conversions), *records.table.notes, *records.notes]
    return [f"{source}: {line}" for line in lines]


def _pair_lines(pairs: Pairs, common: Conversion, missing: str) -> list[str]:
    rest = "are computed from places" if missing == "metric" else "are unreachable"
    told = [*pairs.guesses, *pairs.notes, f"{len(pairs.rows)} distances; missing ones {rest}"]
    if (pairs.source, "distance") in common.words:
        told.append(f"distances{common.words[pairs.source, 'distance']}")
    return [f"{pairs.source}: {line}" for line in told]


def _unplaced(first: Records, second: Records) -> list[str]:
    """Return a line if one table gives places and the other does not."""
    without = [records for records in (first, second) if records.geographic is None]
    if len(without) != 1 or "start_task" in without[0].match.columns:
        return []
    what = "agents" if without[0] is first else "tasks"
    return [f"{without[0].table.source}: no column gives the places of the {what}, so that all distances are 0"]


def _unmet(arguments: Arguments) -> list[str]:
    """Return a line for each skill that a task needs and no agent has."""
    held = {name for names in arguments.get("skills") or [] for name in names}
    needed = dict.fromkeys(name for names in arguments.get("needs") or [] for name in names)
    return [f"no agent has the skill {name!r}, which tasks need" for name in needed if name not in held]
