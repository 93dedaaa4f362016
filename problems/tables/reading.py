"""Tables of agents, tasks and distances to the arguments of an instance."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.given import DistanceTable
from alloc.problems.distances.metric import EUCLIDEAN, GEOGRAPHIC
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.tables.conversion import Conversion, Found, conversion
from alloc.problems.tables.digits import Mark
from alloc.problems.tables.grid import Grid, as_name, grid_of
from alloc.problems.tables.headers import Kind
from alloc.problems.tables.layout import table_of
from alloc.problems.tables.matching import column_named, match_columns
from alloc.problems.tables.pairs import Pairs, pairs_of
from alloc.problems.tables.records import Records, records_of
from alloc.problems.tables.values import names_in, separator_of
from alloc.problems.tables.wanted import Wanted, is_number
from alloc.problems.units import Units
from alloc.problems.vocabulary import IDLE

DECIMALS: Mapping[str, Mark] = {"point": ".", "comma": ","}
ROW = re.compile(r"^(agents|tasks|distances\.rows)\[(\d+)\]")


class Arguments(TypedDict, total=False):
    """What an instance is made of; see `Instance`."""

    ability: FloatArray
    workload: FloatArray
    agent_ids: Sequence[str] | None
    task_ids: Sequence[str] | None
    agent_position: FloatArray | None
    task_position: FloatArray | None
    start_task: IntArray | None
    battery: FloatArray | None
    communication_range: FloatArray | None
    speed: FloatArray | None
    allowed_tasks: list[list[int] | None] | None
    priority: FloatArray | None
    agent_energy_per_distance: FloatArray | None
    returns: NDArray[np.bool_] | None
    skills: list[list[str]] | None
    needs: list[list[str]] | None
    metric: str
    distances: DistanceTable | None
    units: Units


@dataclass(frozen=True)
class Reading:
    """What tables say, and how they were understood.

    Attributes
    ----------
    arguments : dict
        Those of an instance.
    lines : list of str
        What each column was taken for, and what was left out.
    places : dict of str to (str, list of str)
        The source of each table, and what messages call its rows.
    """

    arguments: Arguments
    lines: list[str]
    places: Mapping[str, tuple[str, list[str]]]

    def located(self, error: InputError) -> InputError:
        """Return an error of the instance with its place in the tables."""
        match = ROW.match(error.place)
        if match is None or int(match[2]) >= len(self.places[match[1]][1]):
            return error
        source, rows = self.places[match[1]]
        return InputError(error.message, rows[int(match[2])], source)


def read_tables(
    agents: object,
    tasks: object,
    distances: object | None = None,
    *,
    columns: Mapping[str, str] | None = None,
    units: Units | None = None,
    decimal: str | None = None,
    missing: str | None = None,
) -> Reading:
    """Return what tables of agents, tasks and distances say; see `Instance.from_tables`.

    Raises
    ------
    InputError
        If they can be read in two ways, or in none.
    """
    if decimal is not None and decimal not in DECIMALS:
        raise InputError(f"must be point or comma, got {decimal!r}", "decimal")
    mark = None if decimal is None else DECIMALS[decimal]
    wanted = Wanted(columns or {})
    first = _records(grid_of(agents, "agents"), "agents", wanted, mark)
    second = _records(grid_of(tasks, "tasks"), "tasks", wanted, mark)
    agent_ids, task_ids = _ids(first, "a"), _ids(second, "t")
    pairs = None
    if distances is not None:
        grid = grid_of(distances, "distances")
        pairs = pairs_of(grid, agent_ids, task_ids, wanted.of("distances", grid), mark)
    wanted.require_all_used()
    geographic = _geographic(first, second)
    found = [*first.found, *second.found, *(pairs.found if pairs else [])]
    common = conversion(found, units or Units(), geographic=geographic)
    arguments = _arguments(first, second, common)
    arguments["metric"] = GEOGRAPHIC if geographic else EUCLIDEAN
    lines = [*_lines(first, common), *_lines(second, common)]
    places = {"agents": (first.table.source, first.table.places), "tasks": (second.table.source, second.table.places)}
    if pairs is not None:
        factor = common.factors.get((pairs.source, "distance"), 1.0)
        rows = [(source, target, distance * factor) for source, target, distance in pairs.rows]
        rest = missing or _missing(pairs, first, second)
        places["distances.rows"] = (pairs.source, pairs.places)
        try:
            arguments["distances"] = DistanceTable.of(rows, agent_ids, task_ids, rest)
        except InputError as error:
            raise Reading({}, [], places).located(error) from error
        lines += _pair_lines(pairs, common, rest)
    return Reading(arguments, [*lines, *_unmet(arguments)], places)


def _records(grid: Grid, kind: Kind, wanted: Wanted, mark: Mark | None) -> Records:
    named = wanted.of(kind, grid)
    table = table_of(grid, kind, frozenset(named.values()))
    for field in [field for field, text in named.items() if column_named(table, text) is None and not is_number(text)]:
        match_columns(table, kind, {field: named[field]})  # raises the error that names the columns
    return records_of(match_columns(table, kind, named), mark)


def _ids(records: Records, letter: str) -> list[str]:
    count = len(records.table.rows)
    return records.ids if records.ids is not None else [f"{letter}{number}" for number in range(1, count + 1)]


def _geographic(first: Records, second: Records) -> bool:
    """Return whether places are latitude and longitude; refuse tables that differ."""
    kinds = {records.geographic for records in (first, second)} - {None}
    if len(kinds) > 1:
        told = ["latitude and longitude" if records.geographic else "x and y" for records in (first, second)]
        raise InputError(
            f"gives places by {told[1]}, but {first.table.source} by {told[0]}; give both alike",
            source=second.table.source,
        )
    return bool(kinds and kinds.pop())


def _arguments(first: Records, second: Records, common: Conversion) -> Arguments:
    task_ids = _ids(second, "t")
    skills_at = separator_of([*_cells(first, "skills"), *_cells(second, "needs")])
    skills, needs = first.lists("skills", skills_at), second.lists("needs", skills_at)
    spellings: dict[str, str] = {}
    returns = first.flags("returns")
    priority = second.numbers.get("priority")
    return {
        "ability": _scaled(first, "ability", common),
        "workload": _scaled(second, "workload", common),
        "agent_ids": first.ids,
        "task_ids": second.ids,
        "agent_position": _positions(first, common),
        "task_position": _positions(second, common),
        "start_task": _starts(first, task_ids),
        "battery": _limit(first, "battery", common),
        "communication_range": _limit(first, "range", common),
        "speed": _limit(first, "speed", common),
        "allowed_tasks": _allowed(first, task_ids),
        "priority": None if priority is None else np.where(np.isnan(priority), 1.0, priority),
        "agent_energy_per_distance": (
            _scaled(first, "energy_per_distance", common) if "energy_per_distance" in first.numbers else None
        ),
        "returns": None if returns is None else np.array(returns),
        "skills": None if skills is None else [_alike(names, spellings) for names in skills],
        "needs": None if needs is None else [_alike(names, spellings) for names in needs],
        "units": common.units,
    }


def _cells(records: Records, name: str) -> list[object]:
    return records.match.cells(name) if name in records.match.columns else []


def _scaled(records: Records, name: str, common: Conversion) -> FloatArray:
    return records.numbers[name] * common.factors.get((records.table.source, name), 1.0)


def _limit(records: Records, name: str, common: Conversion) -> FloatArray | None:
    """Return a field in which an empty cell means that there is no limit."""
    if name not in records.numbers:
        return None
    values = _scaled(records, name, common)
    return np.where(np.isnan(values), np.inf, values)


def _positions(records: Records, common: Conversion) -> FloatArray | None:
    place = records.positions()
    if place is None or records.geographic:
        return place
    return place * [common.factors.get((records.table.source, axis), 1.0) for axis in "xyz"]


def _alike(names: list[str], spellings: dict[str, str]) -> list[str]:
    """Return skills in the letters in which they were first written."""
    return [spellings.setdefault(name.casefold(), name) for name in names]


def _starts(records: Records, task_ids: list[str]) -> IntArray | None:
    if "start_task" not in records.match.columns:
        return None
    index = {name: number for number, name in enumerate(task_ids)}
    names = [as_name(cell) for cell in records.match.cells("start_task")]
    for row, name in enumerate(names):
        if name and name not in index:
            raise _unknown_task(records, name, task_ids, row, "start_task")
    return np.array([index.get(name, IDLE) for name in names], dtype=np.intp)


def _allowed(records: Records, task_ids: list[str]) -> list[list[int] | None] | None:
    """Return the tasks of each agent; an id may itself hold what separates the others."""
    if "tasks" not in records.match.columns:
        return None
    index = {name: number for number, name in enumerate(task_ids)}
    cells = records.match.cells("tasks")
    separator = separator_of(cells)
    allowed: list[list[int] | None] = []
    for row, cell in enumerate(cells):
        names = [as_name(cell)] if as_name(cell) in index else [as_name(name) for name in names_in(cell, separator)]
        if cell is None or [name.casefold() for name in names] in (["all"], ["alle"], ["*"], ["any"]):
            allowed.append(None)
            continue
        for name in names:
            if name not in index:
                raise _unknown_task(records, name, task_ids, row, "tasks")
        allowed.append(sorted({index[name] for name in names}))
    return allowed


def _unknown_task(records: Records, name: str, task_ids: list[str], row: int, field: str) -> InputError:
    message = f"there is no task {name!r}{nearest(name, task_ids)}"
    return records.table.error(message, row, records.match.columns[field])


def _missing(pairs: Pairs, first: Records, second: Records) -> str:
    """Return what holds for pairs without a distance: the metric where all have places and none is closed."""
    placed = first.geographic is not None and second.geographic is not None
    return "metric" if placed and not pairs.closed else "unreachable"


def _lines(records: Records, common: Conversion) -> list[str]:
    source = records.table.source
    words = {field: text for (owner, field), text in common.words.items() if owner == source}
    lines = [*records.match.guesses(words), *records.table.notes, *records.notes]
    return [f"{source}: {line}" for line in lines]


def _pair_lines(pairs: Pairs, common: Conversion, missing: str) -> list[str]:
    rest = "are those between places" if missing == "metric" else "mean that nobody can go there"
    told = [*pairs.guesses, *pairs.notes, f"{len(pairs.rows)} distances; those left out {rest}"]
    if (pairs.source, "distance") in common.words:
        told.append(f"distances{common.words[pairs.source, 'distance']}")
    return [f"{pairs.source}: {line}" for line in told]


def _unmet(arguments: Arguments) -> list[str]:
    """Return a line for each skill that a task needs and no agent has."""
    held = {name for names in arguments.get("skills") or [] for name in names}
    needed = dict.fromkeys(name for names in arguments.get("needs") or [] for name in names)
    return [f"no agent has the skill {name!r}, which tasks need" for name in needed if name not in held]
