"""Conversion of instances to and from plain objects for JSON (alloc-instance/1)."""

from collections.abc import Sequence
from typing import TypedDict

import numpy as np

from alloc.problems.errors import InputError
from alloc.problems.formats import json_columns as columns_of
from alloc.problems.formats.columns import (
    AGENT_FIELDS,
    BASE_FIELDS,
    DEFAULT_ENERGY_PER_DISTANCE,
    DEFAULT_MISSING,
    DEFAULT_NAME,
    DEFAULT_TAU,
    DISTANCE_FIELDS,
    INSTANCE_FORMAT,
    TASK_FIELDS,
    UNIT_FIELDS,
    Columns,
    DistanceColumns,
    check_names,
    plain_numbers,
    require_format,
)
from alloc.problems.formats.json_columns import Row, require_known
from alloc.problems.formats.json_text import require_object
from alloc.problems.formats.messages import described
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.units import Units
from alloc.problems.vocabulary import EUCLIDEAN

HEADER_FIELDS = ("format", "name", "tau", "energy_per_distance", "metric", "units", "distances")
INSTANCE_FIELDS = (*HEADER_FIELDS, "bases", "agents", "tasks")


class HeaderValues(TypedDict):
    """The fields of `Columns` that do not belong to single agents or tasks."""

    name: str
    tau: float
    energy_per_distance: float
    metric: str
    units: Units
    speed_unit: str


def from_document(document: object, *, default_name: str = DEFAULT_NAME) -> Instance:
    """Return the instance in a document of plain objects.

    Parameters
    ----------
    document : dict
        As returned by `json.load`; see docs/data/formats.md.
    default_name : str
        Name of the instance if the document has none.

    Raises
    ------
    InputError
        If the document breaks the rules of the format.
    """
    header = require_object(document)
    require_format(header.get("format"))
    require_known(header, INSTANCE_FIELDS, "")
    agents = columns_of.rows(header, "agents", AGENT_FIELDS)
    tasks = columns_of.rows(header, "tasks", TASK_FIELDS)
    bases = [] if header.get("bases") is None else columns_of.rows(header, "bases", BASE_FIELDS)
    return Columns(
        **header_values(header, default_name),
        agent_ids=columns_of.texts(agents, "agents", "id"),
        task_ids=columns_of.texts(tasks, "tasks", "id"),
        ability=columns_of.numbers(agents, "agents", "ability"),
        workload=columns_of.numbers(tasks, "tasks", "workload"),
        agent_position=columns_of.positions(agents, "agents"),
        task_position=columns_of.positions(tasks, "tasks"),
        start_task=columns_of.nullable_texts(agents, "agents", "start_task"),
        battery=columns_of.nullable_numbers(agents, "agents", "battery"),
        communication_range=columns_of.nullable_numbers(agents, "agents", "range"),
        speed=columns_of.nullable_numbers(agents, "agents", "speed"),
        tasks=columns_of.text_lists(agents, "agents", "tasks"),
        priority=columns_of.nullable_numbers(tasks, "tasks", "priority"),
        agent_energy_per_distance=columns_of.nullable_numbers(agents, "agents", "energy_per_distance"),
        returns=columns_of.returns(agents, "agents", "returns"),
        skills=columns_of.name_lists(agents, "agents", "skills"),
        needs=columns_of.name_lists(tasks, "tasks", "needs"),
        distances=_distances(header.get("distances")),
        base_ids=columns_of.texts(bases, "bases", "id"),
        base_position=columns_of.positions(bases, "bases"),
    ).build()


def to_document(instance: Instance) -> Row:
    """Return `instance` as plain objects, ready for `json.dump`; `from_document` is the inverse.

    Raises
    ------
    InputError
        If an id cannot be stored in files.
    """
    check_names(instance)
    document = {**header_document(instance), "agents": agent_rows(instance), "tasks": task_rows(instance)}
    if instance.bases.ids:
        document["bases"] = base_rows(instance)
    if instance.distances is not None:
        document["distances"] = {
            "missing": instance.distances.missing,
            "rows": list(map(list, distance_rows(instance))),
        }
    return document


def agent_rows(instance: Instance) -> list[Row]:
    """Return the agents of an instance as plain objects, without fields that no agent uses."""
    columns: dict[str, Sequence[object]] = {
        "id": instance.agent_ids,
        "ability": plain_numbers(instance.ability),
        "position": plain_positions(instance.agent_position),
        "start_task": start_task_ids(instance),
        "battery": plain_numbers(instance.battery),
        "range": plain_numbers(instance.communication_range),
        "speed": plain_numbers(instance.speed),
        "tasks": allowed_task_ids(instance),
    }
    rates = own_rates(instance)
    if rates is not None:
        columns["energy_per_distance"] = plain_numbers(rates)
    if instance.returns.any():
        columns["returns"] = returns_of(instance)
    if instance.skills is not None:
        columns["skills"] = list(map(list, instance.skills))
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def task_rows(instance: Instance) -> list[Row]:
    """Return the tasks of an instance as plain objects, without fields that no task uses."""
    columns: dict[str, Sequence[object]] = {
        "id": instance.task_ids,
        "workload": plain_numbers(instance.workload),
        "position": plain_positions(instance.task_position),
        "priority": plain_numbers(instance.priority),
    }
    if instance.needs is not None:
        columns["needs"] = list(map(list, instance.needs))
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def base_rows(instance: Instance) -> list[Row]:
    """Return the bases of an instance as plain objects."""
    places = plain_positions(instance.bases.position)
    return [{"id": name, "position": place} for name, place in zip(instance.bases.ids, places, strict=True)]


def returns_of(instance: Instance) -> list[bool | str]:
    """Return the base of each agent, or whether it returns to its start."""
    base, names = instance.return_base.tolist(), instance.bases.ids
    return [names[b] if b >= 0 else flag for flag, b in zip(instance.returns.tolist(), base, strict=True)]


def own_rates(instance: Instance) -> FloatArray | None:
    """Return the energy per distance of each agent, NaN if equal to the instance's; None if equal for all."""
    rates, usual = instance.agent_energy_per_distance, instance.energy_per_distance
    return None if (rates == usual).all() else np.where(rates == usual, np.nan, rates)


def distance_rows(instance: Instance) -> list[tuple[str, str, float | int | None]]:
    """Return the rows of the table of distances: ids of both nodes, and distance."""
    table = instance.distances
    if table is None:
        return []
    names = (*instance.agent_ids, *instance.task_ids, *instance.bases.ids)
    source, target = ([names[node] for node in nodes.tolist()] for nodes in (table.source, table.target))
    return list(zip(source, target, plain_numbers(table.distance), strict=True))


def header_document(instance: Instance) -> Row:
    """Return the fields that do not belong to single agents or tasks, without distances."""
    tau, energy = plain_numbers(np.array([instance.tau, instance.energy_per_distance]))
    header: Row = {"format": INSTANCE_FORMAT, "name": instance.name, "tau": tau, "energy_per_distance": energy}
    if instance.metric != EUCLIDEAN:
        header["metric"] = instance.metric
    units = unit_labels(instance)
    return {**header, "units": units} if units else header


def unit_labels(instance: Instance) -> dict[str, str]:
    """Return the given labels of units, by quantity."""
    return {name: label for name, label in vars(instance.units).items() if label}


def header_values(header: Row, default_name: str) -> HeaderValues:
    """Return the fields that do not belong to single agents or tasks, with defaults."""
    units, speed_unit = _units(header.get("units"))
    return {
        "name": _text(header, "name", "name", default_name),
        "tau": _number(header, "tau", DEFAULT_TAU),
        "energy_per_distance": _number(header, "energy_per_distance", DEFAULT_ENERGY_PER_DISTANCE),
        "metric": _text(header, "metric", "metric", EUCLIDEAN),
        "units": units,
        "speed_unit": speed_unit,
    }


def missing_rule(table: Row) -> str:
    """Return the treatment of pairs that are not in a table of distances."""
    return _text(table, "missing", "distances.missing", DEFAULT_MISSING)


def _units(given: object) -> tuple[Units, str]:
    """Return the labels of units, and the unit of speeds if it differs."""
    if given is None:
        return Units(), ""
    fields = require_object(given, "units")
    require_known(fields, UNIT_FIELDS, "units")
    labels = {name: _text(fields, name, f"units.{name}", "") for name in UNIT_FIELDS}
    speed = labels.pop("speed")
    return Units(**labels), speed


def _distances(given: object) -> DistanceColumns | None:
    if given is None:
        return None
    table = require_object(given, "distances")
    require_known(table, DISTANCE_FIELDS, "distances")
    rows = table.get("rows")
    if not isinstance(rows, list):
        raise InputError(f"must be a list of [from, to, distance], got {described(rows)}", "distances.rows")
    if not set(map(type, rows)) <= {list} or not set(map(len, rows)) <= {3}:
        for number, row in enumerate(rows):
            if not isinstance(row, list | tuple) or len(row) != 3:
                raise InputError(f"must be [from, to, distance], got {described(row)}", f"distances.rows[{number}]")
    source, target, distance = zip(*rows, strict=True) if rows else ((), (), ())
    for column, values in enumerate((source, target)):
        if not set(map(type, values)) <= {str}:
            row = next(row for row, value in enumerate(values) if not isinstance(value, str))
            message = f"must be the id of an agent or a task, got {described(values[row])}"
            raise InputError(message, f"distances.rows[{row}][{column}]")
    numbers = columns_of.required_numbers(distance, "distances.rows[{}][2]")
    return DistanceColumns(source=source, target=target, distance=numbers, missing=missing_rule(table))


def _text(fields: Row, name: str, place: str, default: str) -> str:
    value = fields.get(name)
    if not isinstance(value, str | None):
        raise InputError(f"must be a string, got {described(value)}", place)
    return default if value is None else value


def _number(header: Row, field: str, default: float) -> float:
    value = float(columns_of.numbers([header], "", field)[0])
    return default if np.isnan(value) else value


def start_task_ids(instance: Instance) -> list[str | None]:
    """Return the id of the start task of each agent, None for none."""
    names: list[str | None] = [*instance.task_ids, None]
    return [names[task] for task in instance.start_task.tolist()]


def allowed_task_ids(instance: Instance) -> list[list[str] | None]:
    """Return the ids of the tasks that each agent may do, None for all."""
    if instance.allowed_tasks is None:
        return [None] * instance.n
    names = instance.task_ids
    return [None if tasks is None else [names[task] for task in tasks.tolist()] for tasks in instance.allowed_tasks]


def plain_positions(positions: FloatArray) -> list[list[float | int | None] | None]:
    """Return positions as written to text, None where unknown."""
    columns = (plain_numbers(column) for column in positions.T)
    return [None if row[0] is None else list(row) for row in zip(*columns, strict=True)]
