"""Tables of distances, with a row per pair or as a matrix."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.tables.conversion import Found
from alloc.problems.tables.grid import Cell, Grid, as_name
from alloc.problems.tables.language.digits import Mark
from alloc.problems.tables.layout import Table, table_of
from alloc.problems.tables.matching import Match, match_columns
from alloc.problems.tables.numeric import Numbers

FIELDS = ("from", "to", "distance")
NO_WAY = ("inf", "infinity", "\u221e")


@dataclass
class Pairs:
    """Distances between pairs of ids.

    Attributes
    ----------
    source : str
    rows : list of (str, str, float)
    places : list of str
        Place of each row, for messages.
    found : list of Found
        Unit of the distances.
    closed : bool
        Whether a pair is marked as unreachable.
    guesses, notes : list of str
    """

    source: str
    rows: list[tuple[str, str, float]]
    places: list[str]
    found: list[Found]
    closed: bool
    guesses: list[str]
    notes: list[str]


def pairs_of(
    grid: Grid, agents: Sequence[str], tasks: Sequence[str], wanted: dict[str, str], decimal: Mark | None
) -> Pairs:
    """Return the distances in a table with the columns from, to and distance, or in a matrix between ids.

    Raises
    ------
    InputError
        If it is neither, or a cell is not a distance.
    """
    table = table_of(grid, "distances", frozenset([*agents, *tasks]))
    match = match_columns(table, "distances", wanted)
    known = {*agents, *tasks}
    between = [column for column, header in enumerate(table.headers) if header.text in known]
    if all(name in match.columns for name in FIELDS):
        pairs = _listed(match, decimal)
    elif between:
        pairs = _matrix(table, between, decimal)
    else:
        raise InputError(
            "is not a table of distances; it needs the columns from, to and distance, or a column for each id",
            source=table.source,
        )
    _leave_out(pairs, set(agents) - set(tasks), set(agents) & set(tasks))
    return pairs


def _listed(match: Match, decimal: Mark | None) -> Pairs:
    table, column = match.table, match.columns["distance"]
    values, measure = Numbers(table, {"distance": column}, decimal).read("distance")
    rows, places = [], []
    closed = False
    for row, (source, target) in enumerate(zip(match.cells("from"), match.cells("to"), strict=True)):
        if np.isnan(values[row]):
            closed = closed or _is_closed(table.rows[row][column])
            continue
        rows.append((as_name(source), as_name(target), float(values[row])))
        places.append(table.places[row])
    found = [Found(table.source, table.headers[column].text, "distance", measure)]
    return Pairs(table.source, rows, places, found, closed, match.guesses({}), list(table.notes))


def _matrix(table: Table, between: list[int], decimal: Mark | None) -> Pairs:
    """Return the distances from the ids in the first other column to the ids that name columns."""
    names = next((column for column in range(len(table.headers)) if column not in between), None)
    if names is None:
        raise InputError("has no column with the ids of its rows", source=table.source)
    numbers = Numbers(table, {str(column): column for column in between}, decimal)
    values = {column: numbers.read(str(column))[0] for column in between}
    rows, places = [], []
    for row, cells in enumerate(table.rows):
        for column in between:
            if not np.isnan(values[column][row]):
                rows.append((as_name(cells[names]), table.headers[column].text, float(values[column][row])))
                places.append(f"{table.places[row]}, column {table.headers[column].text!r}")
    closed = any(_is_closed(cells[column]) for cells in table.rows for column in between)
    guesses = [f"a matrix from {len(table.rows)} rows to {len(between)} columns"]
    guesses += [
        f"{header.text}: ignored"
        for column, header in enumerate(table.headers)
        if header.text and column not in between and column != names
    ]
    found = [Found(table.source, "distance", "distance", None)]
    return Pairs(table.source, rows, places, found, closed, guesses, list(table.notes))


def _is_closed(cell: Cell) -> bool:
    """Return whether a cell marks a pair as unreachable, instead of being empty."""
    return as_name(cell).casefold() in NO_WAY


def _leave_out(pairs: Pairs, agents: set[str], unclear: set[str]) -> None:
    """Drop distances between two agents, or from an id to itself, as in full matrices.

    `unclear` ids, which belong to both an agent and a task, are kept, and rejected later by the table of distances.
    """
    kept = [
        number
        for number, (source, target, _) in enumerate(pairs.rows)
        if (source != target or source in unclear) and not (source in agents and target in agents)
    ]
    if len(kept) < len(pairs.rows):
        pairs.notes.append(
            f"{len(pairs.rows) - len(kept)} distances between agents, or from an id to itself, are left out"
        )
        pairs.rows = [pairs.rows[number] for number in kept]
        pairs.places = [pairs.places[number] for number in kept]
