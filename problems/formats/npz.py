"""Instances as columnar .npz files, with one array per field, for up to millions of agents."""

from collections.abc import Mapping, Sequence
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import (
    DEFAULT_ENERGY_PER_DISTANCE,
    DEFAULT_MISSING,
    DEFAULT_TAU,
    INSTANCE_FORMAT,
    UNIT_FIELDS,
    Columns,
    DistanceColumns,
    check_names,
    require_format,
)
from alloc.problems.formats.document import allowed_task_ids, own_rates, start_task_ids, unit_labels
from alloc.problems.formats.npz_archive import FIELDS, LARGEST, REQUIRED, load, packed
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.units import Units
from alloc.problems.vocabulary import EUCLIDEAN

Arrays = Mapping[str, NDArray[np.generic]]


def from_npz(data: bytes, default_name: str) -> Instance:
    """Return the instance in the bytes of an .npz file, without unpickling anything.

    Raises
    ------
    InputError
        If it is not such a file or breaks the rules of the format; places are such as ``agent_ability[3]``.
    """
    arrays = load(data)
    require_format(str(arrays["format"][()]) if "format" in arrays else None)
    for name in REQUIRED:
        if name not in arrays:
            raise InputError("is missing", f"array {name}")
    _check_lengths(arrays)
    if "base_position" in arrays and "base_id" not in arrays:
        raise InputError("is missing; base_position needs it", "array base_id")
    columns = Columns(
        name=_text(arrays, "name", default_name),
        tau=_scalar(arrays, "tau", DEFAULT_TAU),
        energy_per_distance=_scalar(arrays, "energy_per_distance", DEFAULT_ENERGY_PER_DISTANCE),
        agent_ids=arrays["agent_id"].tolist(),
        task_ids=arrays["task_id"].tolist(),
        ability=_numbers(arrays, "agent_ability"),
        workload=_numbers(arrays, "task_workload"),
        agent_position=_optional(arrays, "agent_position"),
        task_position=_optional(arrays, "task_position"),
        start_task=_start_tasks(arrays),
        battery=_optional(arrays, "agent_battery"),
        communication_range=_optional(arrays, "agent_range"),
        speed=_optional(arrays, "agent_speed"),
        tasks=_lists(arrays, "agent_tasks"),
        priority=_optional(arrays, "task_priority"),
        metric=_text(arrays, "metric", "") or EUCLIDEAN,
        units=_units(arrays),
        speed_unit=_text(arrays, "units_speed", ""),
        agent_energy_per_distance=_optional(arrays, "agent_energy_per_distance"),
        returns=_returns(arrays),
        skills=_lists(arrays, "agent_skills"),
        needs=_lists(arrays, "task_needs"),
        distances=_distances(arrays),
        base_ids=arrays["base_id"].tolist() if "base_id" in arrays else (),
        base_position=_optional(arrays, "base_position"),
    )
    try:
        return columns.build()
    except InputError as error:
        message = error.message.replace("say true, false or the id of one of the 'bases'", "list it in base_id")
        raise InputError(message, _translated(error.place)) from error


def to_npz(instance: Instance) -> bytes:
    """Return `instance` as the bytes of an .npz file, deterministically; null columns are left out.

    Raises
    ------
    InputError
        If an id cannot be stored in the format, or ids are too long.
    """
    check_names(instance)
    return packed(_arrays(instance))


def _arrays(instance: Instance) -> dict[str, NDArray[np.generic]]:
    arrays: dict[str, NDArray[np.generic]] = {
        "format": np.array(INSTANCE_FORMAT),
        "name": np.array(instance.name),
        "tau": np.array(instance.tau),
        "energy_per_distance": np.array(instance.energy_per_distance),
        "agent_id": _texts(instance.agent_ids),
        "agent_ability": instance.ability,
        "agent_position": instance.agent_position,
        "agent_battery": instance.battery,
        "agent_range": instance.communication_range,
        "agent_speed": instance.speed,
        "task_id": _texts(instance.task_ids),
        "task_workload": instance.workload,
        "task_position": instance.task_position,
        "task_priority": instance.priority,
    }
    for name in ("agent_battery", "agent_range", "agent_speed"):
        arrays[name] = np.where(np.isinf(arrays[name]), np.nan, arrays[name])
    arrays = {key: value for key, value in arrays.items() if value.dtype.kind != "f" or not np.isnan(value).all()}
    if (instance.start_task >= 0).any():
        arrays["agent_start_task"] = _texts([name or "" for name in start_task_ids(instance)])
    if instance.allowed_tasks is not None:
        arrays |= _list_arrays("agent_tasks", allowed_task_ids(instance))
    return arrays | _optional_arrays(instance)


def _optional_arrays(instance: Instance) -> dict[str, NDArray[np.generic]]:
    """Return the arrays that are written only if the instance uses them."""
    arrays: dict[str, NDArray[np.generic]] = {}
    if instance.metric != EUCLIDEAN:
        arrays["metric"] = np.array(instance.metric)
    arrays |= {f"units_{name}": np.array(label) for name, label in unit_labels(instance).items()}
    rates = own_rates(instance)
    if rates is not None:
        arrays["agent_energy_per_distance"] = rates
    if instance.returns.any():
        arrays["agent_returns"] = instance.returns
    if instance.bases.ids:
        arrays |= {"base_id": _texts(instance.bases.ids), "base_position": instance.bases.position}
        names = (*instance.bases.ids, "")
        arrays["agent_return_base"] = _texts([names[base] for base in instance.return_base.tolist()])
    for name, lists in (("agent_skills", instance.skills), ("task_needs", instance.needs)):
        if lists is not None:
            arrays |= _list_arrays(name, lists)
    table = instance.distances
    if table is not None:
        ids = _texts((*instance.agent_ids, *instance.task_ids, *instance.bases.ids))
        arrays |= {"distance_from": ids[table.source], "distance_to": ids[table.target], "distance": table.distance}
        arrays["distance_missing"] = np.array(table.missing)
    return arrays


def _list_arrays(name: str, lists: Sequence[Sequence[str] | None]) -> dict[str, NDArray[np.generic]]:
    """Return lists as an array of their lengths, -1 for None, and one of their entries."""
    return {
        f"{name}_count": np.array([-1 if entry is None else len(entry) for entry in lists]),
        name: _texts([text for entry in lists for text in entry or ()]),
    }


def _texts(texts: tuple[str, ...] | list[str]) -> NDArray[np.generic]:
    width = max(map(len, texts), default=1)
    if 4 * width * len(texts) > LARGEST:
        raise InputError(f"ids of up to {width} characters need too much space in .npz; use .json")
    return np.array(texts, dtype=f"U{max(1, width)}")


def _check_lengths(arrays: Arrays) -> None:
    for axis, ids in (("n", "agent_id"), ("m", "task_id"), ("d", "distance_from"), ("b", "base_id")):
        if ids not in arrays:
            continue
        count = len(arrays[ids])
        for name, array in arrays.items():
            if FIELDS[name][1].startswith(axis) and len(array) != count:
                raise InputError(f"has {len(array)} rows, but {ids} has {count}", f"array {name}")


def _numbers(arrays: Arrays, name: str) -> FloatArray:
    with np.errstate(over="ignore"):
        return arrays[name].astype(np.float64)


def _optional(arrays: Arrays, name: str) -> FloatArray | None:
    return _numbers(arrays, name) if name in arrays else None


def _scalar(arrays: Arrays, name: str, default: float) -> float:
    value = float(arrays[name][()]) if name in arrays else default
    return default if np.isnan(value) else value


def _text(arrays: Arrays, name: str, default: str) -> str:
    return str(arrays[name][()]) if name in arrays else default


def _units(arrays: Arrays) -> Units:
    try:
        return Units(**{name: _text(arrays, f"units_{name}", "") for name in UNIT_FIELDS if name != "speed"})
    except InputError as error:
        raise InputError(error.message, _translated(error.place)) from error


def _start_tasks(arrays: Arrays) -> list[str | None] | None:
    if "agent_start_task" not in arrays:
        return None
    return [name or None for name in arrays["agent_start_task"].tolist()]


def _returns(arrays: Arrays) -> list[bool | str] | None:
    """Return the base of each agent, or whether it returns to its start."""
    if "agent_return_base" not in arrays:
        return arrays["agent_returns"].tolist() if "agent_returns" in arrays else None
    names = arrays["agent_return_base"].tolist()
    flags = arrays["agent_returns"].tolist() if "agent_returns" in arrays else [bool(name) for name in names]
    for row, (name, flag) in enumerate(zip(names, flags, strict=True)):
        if name and not flag:
            raise InputError(
                "names a base, but agent_returns says that it does not return", f"agent_return_base[{row}]"
            )
    return [name or flag for name, flag in zip(names, flags, strict=True)]


def _distances(arrays: Arrays) -> DistanceColumns | None:
    names = ("distance_from", "distance_to", "distance")
    absent = [name for name in names if name not in arrays]
    if len(absent) == len(names):
        if "distance_missing" in arrays:
            raise InputError("needs the arrays distance_from, distance_to and distance", "array distance_missing")
        return None
    if absent:
        raise InputError(f"is missing; {', '.join(names)} need each other", f"array {absent[0]}")
    source, target = arrays["distance_from"].tolist(), arrays["distance_to"].tolist()
    missing = _text(arrays, "distance_missing", DEFAULT_MISSING)
    return DistanceColumns(source=source, target=target, distance=_numbers(arrays, "distance"), missing=missing)


def _lists(arrays: Arrays, name: str) -> list[list[str] | None] | None:
    """Split an array into one list per agent or task; a count of -1 stands for None."""
    if (name in arrays) != (f"{name}_count" in arrays):
        raise InputError(f"the arrays '{name}' and '{name}_count' need each other; one is missing")
    if name not in arrays:
        return None
    counts = arrays[f"{name}_count"].tolist()
    wrong = next((row for row, count in enumerate(counts) if count < -1), None)
    if wrong is not None:
        null = "all tasks" if name == "agent_tasks" else "none"
        raise InputError(f"must be at least 0, or -1 for {null}, got {counts[wrong]}", f"{name}_count[{wrong}]")
    names = arrays[name].tolist()
    ends = list(accumulate((count if count > 0 else 0 for count in counts), initial=0))
    if ends[-1] != len(names):
        raise InputError(f"sums up to {ends[-1]}, but {name} has {len(names)} entries", f"array {name}_count")
    return [None if count < 0 else names[end - count : end] for count, end in zip(counts, ends[1:], strict=True)]


def _translated(place: str) -> str:
    """Convert a place such as ``agents[3].ability`` to ``agent_ability[3]``."""
    owner, bracket, rest = place.partition("[")
    row, _, field = rest.partition("]")
    if owner == "distances.rows":
        name = {"[0]": "distance_from", "[1]": "distance_to"}.get(field, "distance")
        return f"{name}[{row}]"
    if not bracket:
        return place.replace("units.", "units_").replace("distances.", "distance_")
    return f"{owner.removesuffix('s')}_{field.removeprefix('.')}[{row}]"
