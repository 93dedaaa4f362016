"""An instance as a folder of tables: agents.csv, tasks.csv; optionally bases.csv, distances.csv, instance.json."""

import os
import re
import secrets
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.columns import Columns, DistanceColumns, check_names, require_format
from alloc.problems.formats.csv_table import Table, read_table, table_text
from alloc.problems.formats.document import (
    HEADER_FIELDS,
    HeaderValues,
    agent_rows,
    base_rows,
    distance_rows,
    header_document,
    header_values,
    missing_rule,
    task_rows,
)
from alloc.problems.formats.files import read_text, write_text_atomically
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.formats.messages import reason, unwritable
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import GEOGRAPHIC

AXES, GEOGRAPHIC_AXES = ("x", "y", "z"), ("lon", "lat", "alt")
AGENT_COLUMNS = ("id", "ability", *AXES, "start_task", "battery", "range", "speed", "tasks")
TASK_COLUMNS = ("id", "workload", *AXES, "priority")
MORE_AGENT_COLUMNS = ("energy_per_distance", "returns", "skills")
MORE_TASK_COLUMNS = ("needs",)
"""Optional columns that are written only if the instance uses them."""

DISTANCE_COLUMNS = ("from", "to", "distance")
AGENTS, TASKS, BASES = "agents.csv", "tasks.csv", "bases.csv"
DISTANCES, HEADER = "distances.csv", "instance.json"
FILES = (AGENTS, TASKS, BASES, DISTANCES, HEADER)
BASE_COLUMNS = ("id", *AXES)


class Header(NamedTuple):
    """Content of instance.json; the rule for missing pairs is None if it does not mention distances."""

    values: HeaderValues
    missing: str | None


def read_folder(folder: Path, default_name: str) -> Instance:
    """Return the instance in `folder`.

    Raises
    ------
    InputError
        If a file is missing or breaks the rules of the format; `place` names the file, its line and the column.
    """
    header = _read_header(folder / HEADER, default_name)
    axes = GEOGRAPHIC_AXES if header.values["metric"] == GEOGRAPHIC else AXES
    agents = _read_placed(folder / AGENTS, (*AGENT_COLUMNS, *MORE_AGENT_COLUMNS), ("id", "ability"), axes)
    tasks = _read_placed(folder / TASKS, (*TASK_COLUMNS, *MORE_TASK_COLUMNS), ("id", "workload"), axes)
    bases = _read_placed(folder / BASES, BASE_COLUMNS, ("id",), axes) if os.path.lexists(folder / BASES) else None
    table = _read_distances(folder / DISTANCES, header.missing)
    ability, workload = agents.numbers("ability"), tasks.numbers("workload")
    assert ability is not None, "a required column"
    assert workload is not None, "a required column"
    columns = Columns(
        **header.values,
        agent_ids=agents.cells["id"],
        task_ids=tasks.cells["id"],
        ability=ability,
        workload=workload,
        agent_position=agents.positions(axes),
        task_position=tasks.positions(axes),
        start_task=agents.texts("start_task"),
        battery=agents.numbers("battery"),
        communication_range=agents.numbers("range"),
        speed=agents.numbers("speed"),
        tasks=agents.lists("tasks"),
        priority=tasks.numbers("priority"),
        agent_energy_per_distance=agents.numbers("energy_per_distance"),
        returns=agents.returns("returns"),
        skills=agents.lists("skills"),
        needs=tasks.lists("needs"),
        distances=None if table is None else _distances(table, header.missing),
        base_ids=() if bases is None else bases.cells["id"],
        base_position=None if bases is None else bases.positions(axes),
    )
    try:
        return columns.build()
    except InputError as error:
        tables = {"agents": agents, "tasks": tasks, "bases": bases}
        message = error.message.replace("of the 'bases'", f"in {BASES}")
        raise InputError(message, _translated(error.place, tables, table, axes)) from error


def write_folder(instance: Instance, folder: Path) -> None:
    """Write `instance` into `folder`, which is created if it does not exist; files with other names are kept.

    Tables of distances and bases of a previous instance are removed.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    check_names(instance)
    texts = _texts(instance)
    if os.path.lexists(folder):
        for name, text in texts.items():
            write_text_atomically(folder / name, text)
        for name in (BASES, DISTANCES):
            if name not in texts:
                _remove(folder / name)  # from a previous instance; it would be read as part of this one
        return
    beside = folder.parent / f".alloc-{secrets.token_hex(8)}.tmp"
    try:
        beside.mkdir()
        for name, text in texts.items():
            write_text_atomically(beside / name, text)
        os.rename(beside, folder)
    except InputError as error:
        raise InputError(error.message) from error  # without the name of the temporary file
    except (OSError, ValueError) as error:
        raise unwritable(error, folder) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _texts(instance: Instance) -> dict[str, str]:
    """Return the text of each file."""
    axes = GEOGRAPHIC_AXES if instance.metric == GEOGRAPHIC else AXES
    texts = {
        AGENTS: table_text(_columns(agent_rows(instance), AGENT_COLUMNS, MORE_AGENT_COLUMNS, axes)),
        TASKS: table_text(_columns(task_rows(instance), TASK_COLUMNS, MORE_TASK_COLUMNS, axes)),
    }
    if instance.bases.ids:
        texts[BASES] = table_text(_columns(base_rows(instance), BASE_COLUMNS, (), axes))
    header = header_document(instance)
    if instance.distances is not None:
        header["distances"] = {"missing": instance.distances.missing}
        rows = distance_rows(instance)
        columns = {name: [row[number] for row in rows] for number, name in enumerate(DISTANCE_COLUMNS)}
        texts[DISTANCES] = table_text(columns)
    return {**texts, HEADER: json_text.lines(header)}


def _columns(
    rows: Sequence[Row], columns: Sequence[str], more: Sequence[str], axes: Sequence[str]
) -> dict[str, Sequence[object]]:
    """Return the columns of a table, with positions under the names `axes`."""
    table: dict[str, Sequence[object]] = {}
    places = [row["position"] for row in rows]
    for column in (*columns, *(name for name in more if name in rows[0])):
        if column in AXES:
            axis = AXES.index(column)
            table[axes[axis]] = [place[axis] if isinstance(place, list) else None for place in places]
        elif column in ("skills", "needs"):  # no list and an empty list are equivalent
            table[column] = [row[column] or None for row in rows]
        else:
            table[column] = [row[column] for row in rows]
    return table


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f"cannot be removed: {reason(error)}", path.name) from error


def _read_header(path: Path, default_name: str) -> Header:
    if not os.path.lexists(path):
        return Header(header_values({}, default_name), None)
    try:
        header = json_text.require_object(json_text.parse(read_text(path)))
        require_format(header.get("format"))
        require_known(header, HEADER_FIELDS, "")
        return Header(header_values(header, default_name), _missing(header.get("distances")))
    except InputError as error:
        place = f"{path.name} {error.place}" if error.place.startswith("line") else f"{path.name}, {error.place}"
        raise InputError(error.message, place.removesuffix(", ")) from error


def _missing(given: object) -> str | None:
    if given is None:
        return None
    table = json_text.require_object(given, "distances")
    if "rows" in table:
        raise InputError(f"must be in {DISTANCES}, with columns {','.join(DISTANCE_COLUMNS)}", "distances.rows")
    require_known(table, ("missing",), "distances")
    return missing_rule(table)


def _read_placed(path: Path, columns: Sequence[str], required: Sequence[str], axes: Sequence[str]) -> Table:
    """Return a table with positions; raise an error with a hint for a column of the other kind of positions."""
    names = dict(zip(AXES, axes, strict=True))
    table = read_table(path, (*(names.get(column, column) for column in columns), *_others(axes)), required)
    for other, axis in zip(_others(axes), axes, strict=True):
        if other in table.cells:
            mend = f"or call it {axis!r}" if axes is AXES else f"call it {axis!r}"
            metric = f'needs "metric": "geographic" in {HEADER}' if axes is AXES else "is not geographic"
            raise InputError(f"the column {other!r} {metric}; {mend}", path.name)
    return table


def _others(axes: Sequence[str]) -> Sequence[str]:
    return AXES if axes is GEOGRAPHIC_AXES else GEOGRAPHIC_AXES


def _read_distances(path: Path, missing: str | None) -> Table | None:
    if not os.path.lexists(path):
        if missing is not None:
            raise InputError(f"is missing, but {HEADER} has the field 'distances'", path.name)
        return None
    return read_table(path, DISTANCE_COLUMNS, DISTANCE_COLUMNS)


def _distances(table: Table, missing: str | None) -> DistanceColumns:
    distance = table.numbers("distance")
    assert distance is not None, "a required column"
    columns = DistanceColumns(source=table.cells["from"], target=table.cells["to"], distance=distance)
    return columns if missing is None else replace(columns, missing=missing)


def _translated(place: str, tables: Mapping[str, Table | None], distances: Table | None, axes: Sequence[str]) -> str:
    """Convert a place such as ``agents[3].ability`` to ``agents.csv line 5, column ability``."""
    match = re.fullmatch(r"distances\.rows\[(\d+)\](?:\[(\d)\])?", place)
    if match is not None and distances is not None:
        row, column = int(match[1]), match[2]
        return distances.place(row, DISTANCE_COLUMNS[int(column)] if column else "distance")
    match = re.fullmatch(r"(agents|tasks|bases)(?:\[(\d+)\]\.(\w+))?", place)
    table = None if match is None else tables[match[1]]
    if match is None or table is None:
        return place and f"{HEADER}, {place}"
    if match[2] is None:
        return table.file
    return table.place(int(match[2]), " and ".join(axes[:2]) if match[3] == "position" else match[3])
