"""Arrays in .npz files: read without unpickling, and written deterministically."""

import io
import math
import zipfile
from collections.abc import Mapping

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import UNIT_FIELDS, unknown_field
from alloc.problems.formats.messages import message_line, quoted

LARGEST = 4 << 30
"""Maximum number of bytes of the uncompressed arrays of a file."""

TEXTS, NUMBERS, COUNTS, FLAGS = "strings", "numbers", "whole numbers", "booleans"
KINDS = {TEXTS: "U", NUMBERS: "fiu", COUNTS: "iu", FLAGS: "b"}

FIELDS: dict[str, tuple[str, str]] = {
    "format": (TEXTS, ""),
    "name": (TEXTS, ""),
    "tau": (NUMBERS, ""),
    "energy_per_distance": (NUMBERS, ""),
    "metric": (TEXTS, ""),
    **{f"units_{name}": (TEXTS, "") for name in UNIT_FIELDS},
    "agent_id": (TEXTS, "n"),
    "agent_ability": (NUMBERS, "n"),
    "agent_position": (NUMBERS, "n,3"),
    "agent_start_task": (TEXTS, "n"),
    "agent_battery": (NUMBERS, "n"),
    "agent_range": (NUMBERS, "n"),
    "agent_speed": (NUMBERS, "n"),
    "agent_tasks_count": (COUNTS, "n"),
    "agent_tasks": (TEXTS, "k"),
    "agent_energy_per_distance": (NUMBERS, "n"),
    "agent_returns": (FLAGS, "n"),
    "agent_return_base": (TEXTS, "n"),
    "agent_skills_count": (COUNTS, "n"),
    "agent_skills": (TEXTS, "k"),
    "task_id": (TEXTS, "m"),
    "task_workload": (NUMBERS, "m"),
    "task_position": (NUMBERS, "m,3"),
    "task_priority": (NUMBERS, "m"),
    "task_needs_count": (COUNTS, "m"),
    "task_needs": (TEXTS, "k"),
    "base_id": (TEXTS, "b"),
    "base_position": (NUMBERS, "b,3"),
    "distance_from": (TEXTS, "d"),
    "distance_to": (TEXTS, "d"),
    "distance": (NUMBERS, "d"),
    "distance_missing": (TEXTS, ""),
}
"""Kind and shape of each array; length ``d`` is for distances, ``b`` for bases; ``k`` is free."""

REQUIRED = ("format", "agent_id", "agent_ability", "task_id", "task_workload")


def load(data: bytes) -> dict[str, NDArray[np.generic]]:
    """Return the arrays in the bytes of a file, after checking their kinds and dimensions against `FIELDS`.

    Raises
    ------
    InputError
        If it is not such a file, or contains other arrays.
    """
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
    except Exception as error:  # zipfile raises many kinds of errors for damaged archives
        raise InputError(f"is not an .npz file, or is damaged: {_words(error)}") from error


def _check_members(members: list[zipfile.ZipInfo]) -> None:
    names = [_field(member.filename) for member in members]
    for member, name in zip(members, names, strict=True):
        if name not in FIELDS or not member.filename.endswith(".npy"):
            raise InputError(unknown_field(name, tuple(FIELDS), "array"))
        if names.count(name) > 1:
            raise InputError(f"the array {name!r} occurs twice; remove one")
    size = sum(member.file_size for member in members)
    if size > LARGEST:
        raise InputError(f"its arrays take {size / 2**30:.1f} GiB uncompressed; at most {LARGEST >> 30} are read")


def _field(member: str) -> str:
    return member.removesuffix(".npy")


def _read(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[np.generic]:
    """Read one array, after checking that its header matches the size of its data."""
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
    except Exception as error:  # numpy evaluates the header as Python text, which may raise any error
        raise InputError(f"cannot be read: {_words(error)}", f"array {name}") from error
    if array.dtype.kind not in KINDS[kind]:
        raise InputError(f"must hold {kind}, got dtype {array.dtype.name}", f"array {name}")
    dimensions = len(shape.split(",")) if shape else 0
    if array.ndim != dimensions or (dimensions == 2 and array.shape[1] not in (2, 3)):
        raise InputError(f"must have shape ({shape}), got {array.shape}", f"array {name}")
    return array


def _check_promise(content: bytes, name: str) -> None:
    """Raise an `InputError` if a header declares more data than exist, before memory is allocated for them."""
    file = io.BytesIO(content)
    headers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    read_header = headers.get(npy.read_magic(file))
    if read_header is not None:
        shape, _, dtype = read_header(file)
        if math.prod(shape) * dtype.itemsize > len(content):
            raise InputError("cannot be read: its header declares more data than there are", f"array {name}")


def _words(error: Exception) -> str:
    return message_line(str(error), 120) or quoted(type(error).__name__)


def packed(arrays: Mapping[str, NDArray[np.generic]]) -> bytes:
    """Return arrays as the bytes of a file, deterministically."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            member = zipfile.ZipInfo(f"{name}.npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(member, "w", force_zip64=True) as file:
                npy.write_array(file, array, allow_pickle=False)
    return buffer.getvalue()
