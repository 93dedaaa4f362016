"""Conversion of rows of agents and tasks to arguments of `Instance`."""

from collections.abc import Sequence
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from alloc.problems.distances.bases import Bases
from alloc.problems.distances.given import DistanceTable
from alloc.problems.errors import InputError, nearest
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.tables.conversion import Conversion
from alloc.problems.tables.grid import as_name
from alloc.problems.tables.records import Records
from alloc.problems.tables.values import names_in, separators
from alloc.problems.units import Units
from alloc.problems.vocabulary import IDLE


class Arguments(TypedDict, total=False):
    """Arguments of `Instance`."""

    name: str
    ability: FloatArray
    workload: FloatArray
    agent_ids: Sequence[str]
    task_ids: Sequence[str]
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
    return_base: IntArray | None
    bases: Bases
    skills: list[list[str]] | None
    needs: list[list[str]] | None
    metric: str
    distances: DistanceTable | None
    units: Units


def ids_of(records: Records, letter: str) -> list[str]:
    """Return the ids of the rows; by default, a letter and a number."""
    count = len(records.table.rows)
    return records.ids if records.ids is not None else [f"{letter}{number}" for number in range(1, count + 1)]


def arguments_of(first: Records, second: Records, bases: Records | None, common: Conversion) -> Arguments:
    """Return the arguments of an instance, except those about both agents and tasks.

    Raises
    ------
    InputError
        If an agent refers to an unknown task.
    """
    task_ids = ids_of(second, "t")
    skills_at = separators([*_cells(first, "skills"), *_cells(second, "needs")])
    skills, needs = first.lists("skills", skills_at), second.lists("needs", skills_at)
    spellings: dict[str, str] = {}
    base_ids = [] if bases is None else ids_of(bases, "b")
    homes = first.homes(base_ids)
    priority = second.numbers.get("priority")
    return {
        "ability": _scaled(first, "ability", common),
        "workload": _scaled(second, "workload", common),
        "agent_ids": ids_of(first, "a"),
        "task_ids": task_ids,
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
        "returns": None if homes is None else np.array([home is not False for home in homes]),
        "return_base": _return_bases(homes, base_ids),
        "bases": Bases.of(base_ids, None if bases is None else _positions(bases, common)),
        "skills": None if skills is None else [_alike(names, spellings) for names in skills],
        "needs": None if needs is None else [_alike(names, spellings) for names in needs],
        "units": common.units,
    }


def _cells(records: Records, name: str) -> list[object]:
    return records.match.cells(name) if name in records.match.columns else []


def _scaled(records: Records, name: str, common: Conversion) -> FloatArray:
    return records.numbers[name] * common.factors.get((records.table.source, name), 1.0)


def _limit(records: Records, name: str, common: Conversion) -> FloatArray | None:
    """Return a field in which empty cells mean no limit."""
    if name not in records.numbers:
        return None
    values = _scaled(records, name, common)
    return np.where(np.isnan(values), np.inf, values)


def _positions(records: Records, common: Conversion) -> FloatArray | None:
    place = records.positions()
    if place is None or records.geographic:
        return place
    source, factors = records.table.source, common.factors
    first = factors.get((source, "x"), 1.0)  # heights without a unit have that of x
    return place * [factors.get((source, axis), first) for axis in "xyz"]


def _alike(names: list[str], spellings: dict[str, str]) -> list[str]:
    """Return skills in the spelling of their first occurrence."""
    return [spellings.setdefault(name.casefold(), name) for name in names]


def _return_bases(homes: list[bool | str] | None, ids: list[str]) -> IntArray | None:
    if homes is None:
        return None
    return np.array([ids.index(home) if isinstance(home, str) else IDLE for home in homes], dtype=np.intp)


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
    """Return the tasks of each agent; ids may themselves contain separators."""
    if "tasks" not in records.match.columns:
        return None
    index = {name: number for number, name in enumerate(task_ids)}
    cells = records.match.cells("tasks")
    marks = separators(cells)[:1]  # other separators may be part of an id
    allowed: list[list[int] | None] = []
    for row, cell in enumerate(cells):
        names = [as_name(cell)] if as_name(cell) in index else [as_name(name) for name in names_in(cell, marks)]
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
