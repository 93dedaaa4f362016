"""An instance as a columnar .npz file: one array per field, for up to millions of agents."""

import io
import math
import zipfile
from collections.abc import Mapping

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import (
    DEFAULT_ENERGY_PER_DISTANCE,
    DEFAULT_TAU,
    INSTANCE_FORMAT,
    Columns,
    check_names,
    require_format,
    unknown_field,
)
from alloc.problems.formats.document import allowed_task_ids, start_task_ids
from alloc.problems.formats.messages import one_line, quoted
from alloc.problems.instance import FloatArray, Instance

LARGEST = 4 << 30
"""Bytes that the arrays of a file may take unpacked."""

TEXTS, NUMBERS, COUNTS = "strings", "numbers", "whole numbers"
KINDS = {TEXTS: "U", NUMBERS: "fiu", COUNTS: "iu"}

FIELDS: dict[str, tuple[str, str]] = {
    "format": (TEXTS, ""),
    "name": (TEXTS, ""),
    "tau": (NUMBERS, ""),
    "energy_per_distance": (NUMBERS, ""),
    "agent_id": (TEXTS, "n"),
    "agent_ability": (NUMBERS, "n"),
    "agent_position": (NUMBERS, "n,3"),
    "agent_start_task": (TEXTS, "n"),
    "agent_battery": (NUMBERS, "n"),
    "agent_range": (NUMBERS, "n"),
    "agent_speed": (NUMBERS, "n"),
    "agent_tasks_count": (COUNTS, "n"),
    "agent_tasks": (TEXTS, "k"),
    "task_id": (TEXTS, "m"),
    "task_workload": (NUMBERS, "m"),
    "task_position": (NUMBERS, "m,3"),
    "task_priority": (NUMBERS, "m"),
}
"""Kind and shape of each array; ``k`` is free."""

REQUIRED = ("format", "agent_id", "agent_ability", "task_id", "task_workload")

Arrays = Mapping[str, NDArray[np.generic]]


def from_npz(data: bytes, default_name: str) -> Instance:
    """Return the instance in the bytes of an .npz file; nothing in it is ever unpickled.

    Raises
    ------
    InputError
        If it is no such file or breaks the rules of the format; places are ``agent_ability[3]`` or the like.
    """
    arrays = _load(data)
    require_format(str(arrays["format"][()]) if "format" in arrays else None)
    for name in REQUIRED:
        if name not in arrays:
            raise InputError("is missing", f"array {name}")
    _check_lengths(arrays)
    columns = Columns(
        name=str(arrays["name"][()]) if "name" in arrays else default_name,
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
        tasks=_task_lists(arrays),
        priority=_optional(arrays, "task_priority"),
    )
    try:
        return columns.build()
    except InputError as error:
        raise InputError(error.message, _translated(error.place)) from error


def to_npz(instance: Instance) -> bytes:
    """Return `instance` as the bytes of an .npz file, the same for the same instance; null columns are left out.

    Raises
    ------
    InputError
        If an id holds what the format cannot keep, or ids are so long that the file would be.
    """
    check_names(instance)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in _arrays(instance).items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(member, "w", force_zip64=True) as file:
                npy.write_array(file, array, allow_pickle=False)
    return buffer.getvalue()


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
        lists = allowed_task_ids(instance)
        arrays["agent_tasks_count"] = np.array([-1 if names is None else len(names) for names in lists])
        arrays["agent_tasks"] = _texts([name for names in lists for name in names or ()])
    return arrays


def _texts(texts: tuple[str, ...] | list[str]) -> NDArray[np.generic]:
    width = max(map(len, texts), default=1)
    if 4 * width * len(texts) > LARGEST:
        raise InputError(f"ids of up to {width} characters need too much room in .npz; use .json")
    return np.array(texts, dtype=f"U{max(1, width)}")


def _load(data: bytes) -> dict[str, NDArray[np.generic]]:
    if not data:
        raise InputError("is empty; expected an .npz file")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            _check_members(members)
            return {_field(member.filename): _read(archive, member) for member in members}
    except InputError:
        raise
    except MemoryError as error:
        raise InputError("does not fit into memory") from error
    except Exception as error:  # zipfile raises half a dozen kinds for damaged archives
        raise InputError(f"is no .npz file, or damaged: {_words(error)}") from error


def _check_members(members: list[zipfile.ZipInfo]) -> None:
    names = [_field(member.filename) for member in members]
    for member, name in zip(members, names, strict=True):
        if name not in FIELDS or not member.filename.endswith(".npy"):
            raise InputError(unknown_field(name, tuple(FIELDS), "array"))
        if names.count(name) > 1:
            raise InputError(f"the array {name!r} occurs twice; remove one")
    size = sum(member.file_size for member in members)
    if size > LARGEST:
        raise InputError(f"its arrays take {size / 2**30:.1f} GiB unpacked; at most {LARGEST >> 30} are read")


def _field(member: str) -> str:
    return member.removesuffix(".npy")


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[np.generic]:
    """Read one array, after its header: what the header promises must be what the archive holds."""
    name = _field(member.filename)
    kind, shape = FIELDS[name]
    with archive.open(member) as file:
        content = file.read(member.file_size)
        if len(content) != member.file_size or file.read(1):
            raise InputError("is cut off", f"array {name}")
    try:
        _check_promise(content, name)
        array: NDArray[np.generic] = npy.read_array(io.BytesIO(content), allow_pickle=False)
    except (InputError, MemoryError):
        raise
    except Exception as error:  # numpy parses the header as Python text, and passes on what that raises
        raise InputError(f"cannot be read: {_words(error)}", f"array {name}") from error
    if array.dtype.kind not in KINDS[kind]:
        raise InputError(f"must hold {kind}, got dtype {array.dtype.name}", f"array {name}")
    dimensions = len(shape.split(",")) if shape else 0
    if array.ndim != dimensions or (dimensions == 2 and array.shape[1] not in (2, 3)):
        raise InputError(f"must have shape ({shape}), got {array.shape}", f"array {name}")
    return array


def _check_promise(content: bytes, name: str) -> None:
    """Raise an `InputError` where a header promises more than there is: room for it is not even asked for."""
    file = io.BytesIO(content)
    headers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    read_header = headers.get(npy.read_magic(file))
    if read_header is not None:
        shape, _, dtype = read_header(file)
        if math.prod(shape) * dtype.itemsize > len(content):
            raise InputError("cannot be read: its header promises more than there is", f"array {name}")


def _check_lengths(arrays: Arrays) -> None:
    for axis, ids in (("n", "agent_id"), ("m", "task_id")):
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


def _start_tasks(arrays: Arrays) -> list[str | None] | None:
    if "agent_start_task" not in arrays:
        return None
    return [name or None for name in arrays["agent_start_task"].tolist()]


def _task_lists(arrays: Arrays) -> list[list[str] | None] | None:
    """Cut `agent_tasks` into one list per agent; a count of -1 means all tasks."""
    if ("agent_tasks" in arrays) != ("agent_tasks_count" in arrays):
        raise InputError("the arrays 'agent_tasks' and 'agent_tasks_count' need each other; one is missing")
    if "agent_tasks" not in arrays:
        return None
    counts = arrays["agent_tasks_count"].tolist()
    wrong = next((row for row, count in enumerate(counts) if count < -1), None)
    if wrong is not None:
        message = f"must be at least 0, or -1 for all tasks, got {counts[wrong]}"
        raise InputError(message, f"agent_tasks_count[{wrong}]")
    names = arrays["agent_tasks"].tolist()
    total = sum(max(0, count) for count in counts)
    if total != len(names):
        raise InputError(f"sums up to {total}, but agent_tasks has {len(names)} entries", "array agent_tasks_count")
    lists: list[list[str] | None] = []
    begin = 0
    for count in counts:
        lists.append(None if count < 0 else names[begin : begin + count])
        begin += max(0, count)
    return lists


def _translated(place: str) -> str:
    """Turn ``agents[3].ability`` into ``agent_ability[3]``."""
    owner, bracket, rest = place.partition("[")
    row, _, field = rest.partition("].")
    if not bracket:
        return place
    return f"{owner.removesuffix('s')}_{field}[{row}]"


def _words(error: Exception) -> str:
    return one_line(str(error), 120) or quoted(type(error).__name__)
