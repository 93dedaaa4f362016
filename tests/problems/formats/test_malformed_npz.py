"""Each error in a columnar file is one line with file, array, row and correction."""

import io
import struct
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from .conftest import the_error

ARRAYS: dict[str, Any] = {
    "format": "alloc-instance/1",
    "agent_id": ["a1", "a2"],
    "agent_ability": [1.0, 2.0],
    "task_id": ["t1"],
    "task_workload": [3.0],
}


def given(source: list[str], target: list[str], distance: list[float]) -> dict[str, Any]:
    """Return the arrays of a table of distances."""
    return {"distance_from": source, "distance_to": target, "distance": distance}


COLUMNS = [
    ({"format": None}, "format", "is missing"),
    ({"format": "alloc-instance/9"}, "format", "got 'alloc-instance/9'"),
    ({"format": 1}, "array format", "must hold strings, got dtype int64"),
    ({"format": ["alloc-instance/1"]}, "array format", "must have shape (), got (1,)"),
    ({"agent_id": None}, "array agent_id", "is missing"),
    ({"task_workload": None}, "array task_workload", "is missing"),
    ({"agent_abilty": [1]}, "", "unknown array 'agent_abilty' (did you mean 'agent_ability'?)"),
    ({"agent_id": [1, 2]}, "array agent_id", "must hold strings, got dtype int64"),
    ({"agent_id": np.array([b"a", b"b"])}, "array agent_id", "must hold strings, got dtype bytes8"),
    ({"agent_id": np.array(["a", "b"], dtype=object)}, "array agent_id", "cannot be read: object arrays"),
    ({"agent_id": ["a1", "a1"]}, "agent_id[1]", "'a1' is used twice"),
    ({"agent_id": ["a1", ""]}, "agent_id[1]", "must be a non-empty string"),
    ({"agent_id": ["a1"]}, "array agent_ability", "has 2 rows, but agent_id has 1"),
    ({"agent_ability": ["1", "2"]}, "array agent_ability", "must hold numbers"),
    ({"agent_ability": [True, False]}, "array agent_ability", "must hold numbers, got dtype bool"),
    ({"agent_ability": [1j, 2]}, "array agent_ability", "must hold numbers, got dtype complex128"),
    ({"agent_ability": np.zeros(2, "M8[s]")}, "array agent_ability", "must hold numbers"),
    ({"agent_ability": np.zeros(2, [("a", "f8")])}, "array agent_ability", "must hold numbers"),
    ({"agent_ability": [[1.0], [2.0]]}, "array agent_ability", "must have shape (n), got (2, 1)"),
    ({"agent_ability": [1.0, np.nan]}, "agent_ability[1]", "is missing"),
    ({"agent_ability": [1.0, -2]}, "agent_ability[1]", "must be a finite number > 0, got -2"),
    ({"agent_ability": [1.0, np.inf]}, "agent_ability[1]", "must be a finite number > 0, got inf"),
    ({"agent_ability": [], "agent_id": np.array([], dtype="U1")}, "agents", "at least one agent"),
    ({"agent_range": [np.nan, np.inf]}, "agent_range[1]", "must be a finite number, or null for no limit"),
    ({"agent_speed": [0, 1]}, "agent_speed[0]", "must be a number > 0"),
    ({"agent_position": [1.0, 2.0]}, "array agent_position", "must have shape (n,3), got (2,)"),
    ({"agent_position": np.zeros((2, 4))}, "array agent_position", "must have shape (n,3), got (2, 4)"),
    ({"agent_position": np.zeros((3, 3))}, "array agent_position", "has 3 rows, but agent_id has 2"),
    ({"agent_position": [[1, 2, 3], [1, 2, np.nan]]}, "agent_position[1]", "must be finite numbers"),
    ({"agent_start_task": ["", "t2"]}, "agent_start_task[1]", "there is no task 't2'"),
    ({"agent_tasks": ["t1"]}, "", "'agent_tasks' and 'agent_tasks_count' need each other"),
    ({"agent_tasks": ["t1"], "agent_tasks_count": [1, 1]}, "array agent_tasks_count", "sums up to 2"),
    ({"agent_tasks": ["t1"], "agent_tasks_count": [3, -2]}, "agent_tasks_count[1]", "at least 0, or -1"),
    ({"agent_tasks": ["t1"], "agent_tasks_count": [1.0, 0]}, "array agent_tasks_count", "must hold whole numbers"),
    ({"agent_tasks": ["t5"], "agent_tasks_count": [-1, 1]}, "agent_tasks[1]", "there is no task 't5'"),
    ({"agent_returns": [1, 0]}, "array agent_returns", "must hold booleans, got dtype int64"),
    ({"agent_returns": [True]}, "array agent_returns", "has 1 rows, but agent_id has 2"),
    ({"agent_skills": ["x"]}, "", "'agent_skills' and 'agent_skills_count' need each other"),
    ({"task_needs": ["x"], "task_needs_count": [-2]}, "task_needs_count[0]", "at least 0, or -1 for none"),
    ({"task_needs": [""], "task_needs_count": [1]}, "task_needs[0]", "must be non-empty strings"),
    ({"agent_energy_per_distance": [1.0, -1]}, "agent_energy_per_distance[1]", "must be a finite number >= 0"),
    ({"metric": "geo"}, "metric", "must be one of euclidean"),
    ({"units_speed": "m/s", "units_time": "h"}, "units_distance", "is missing"),
    ({"units_work": "x" * 21}, "units_work", "at most 20 characters"),
    ({"distance_missing": "metric"}, "array distance_missing", "needs the arrays distance_from"),
    ({"distance_from": ["a1"]}, "array distance_to", "distance_from, distance_to, distance need each other"),
    (given(["a1"], ["t1"], [1.0, 2]), "array distance", "has 2 rows, but distance_from has 1"),
    (given(["a1", "a3"], ["t1", "t1"], [1.0, 2]), "distance_from[1]", "there is no agent or task 'a3'"),
    (given(["a1"], [""], [1.0]), "distance_to[0]", "there is no agent or task ''"),
    (given(["a1"], ["t1"], [np.nan]), "distance[0]", "must have a distance that is a finite number >= 0"),
    (given(["a1"], ["t1"], [1.0]) | {"distance_missing": "x"}, "distance_missing", "must be 'metric' or"),
    ({"tau": 1.5}, "tau", "must lie strictly between 0 and 1"),
    ({"tau": np.inf}, "tau", "must lie strictly between 0 and 1"),
    ({"energy_per_distance": -1}, "energy_per_distance", "must be a finite number >= 0"),
    ({"name": 5}, "array name", "must hold strings"),
]


@pytest.mark.parametrize(("arrays", "place", "words"), COLUMNS)
def test_invalid_arrays_are_located(tmp_path: Path, arrays: dict[str, Any], place: str, words: str) -> None:
    """Errors in a columnar file name the array and, if applicable, the row."""
    given = {name: value for name, value in {**ARRAYS, **arrays}.items() if value is not None}
    np.savez(tmp_path / "x.npz", **given)
    error = the_error(tmp_path / "x.npz")
    assert error.place == place, str(error)
    assert words in error.message.lower() or words in error.message, str(error)


def archive(**members: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in members.items():
            file.writestr(name.replace("__", "."), data)
    return buffer.getvalue()


def npy(header: str, data: bytes = b"") -> bytes:
    text = header.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data


def bomb() -> bytes:
    """A small archive whose directory declares 5 GiB."""
    data = bytearray(archive(agent_id__npy=b"x" * 1000))
    directory = data.index(b"PK\x01\x02")
    data[directory + 24 : directory + 28] = struct.pack("<I", 0xFFFFFFF0)
    return bytes(data)


BYTES = {
    "empty": (b"", "is empty"),
    "text": (b"id,ability\n", "is not an .npz file"),
    "npy": (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (0,), }"), "is not an .npz file"),
    "no arrays": (archive(), "is missing"),
    "cut off": (archive(agent_id__npy=npy("{}"))[:-30], "is not an .npz file, or is damaged"),
    "other files": (archive(virus__exe=b"x"), "unknown array 'virus.exe'"),
    "no suffix": (archive(format=b"x"), "unknown array 'format'"),
    "no array": (archive(agent_id__npy=b"hello"), "cannot be read"),
    "empty array": (archive(agent_id__npy=b""), "cannot be read"),
    "odd header": (archive(agent_id__npy=npy("__import__('os')")), "cannot be read"),
    "deep header": (archive(agent_id__npy=npy("[" * 110)), "cannot be read"),
    "short data": (
        archive(agent_ability__npy=npy("{'descr': '<f8', 'fortran_order': False, 'shape': (9,), }", b"x" * 8)),
        "cannot be read",
    ),
    "shape of 8 EB": (
        archive(agent_ability__npy=npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000000,), }")),
        "cannot be read",
    ),
    "negative shape": (
        archive(agent_ability__npy=npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }")),
        "",
    ),
    "pickle": (
        archive(agent_id__npy=npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,), }", b"cos\nsystem\n.")),
        "cannot be read: Object arrays cannot be loaded",
    ),
    "more than 4 GiB": (bomb() if sys.byteorder == "little" else b"", ""),
}


@pytest.mark.parametrize("case", BYTES)
def test_invalid_archives_are_refused(tmp_path: Path, case: str) -> None:
    """Bytes that are not a columnar file are refused as such, and nothing is unpickled."""
    data, words = BYTES[case]
    (tmp_path / "x.npz").write_bytes(data)
    assert words in the_error(tmp_path / "x.npz").message


def test_zip_bomb_is_not_unpacked(tmp_path: Path) -> None:
    """An archive of more than 4 GiB uncompressed is refused by its directory, without unpacking."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("agent_id.npy", b"\0" * 1000)
        file.writestr("task_id.npy", b"\0" * 1000)
    data = bytearray(buffer.getvalue())
    position = 0
    while (position := data.find(b"PK\x01\x02", position)) >= 0:
        data[position + 24 : position + 28] = struct.pack("<I", 0xFFFFFFF0)
        position += 4
    (tmp_path / "x.npz").write_bytes(data)
    assert "take 8.0 GiB uncompressed; at most 4 are read" in the_error(tmp_path / "x.npz").message


def test_duplicate_arrays_are_refused(tmp_path: Path) -> None:
    """An archive with two arrays of one name is ambiguous, and refused."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        file.writestr("tau.npy", b"")
        with pytest.warns(UserWarning, match="Duplicate name"):
            file.writestr("tau.npy", b"")
    (tmp_path / "x.npz").write_bytes(buffer.getvalue())
    assert "the array 'tau' occurs twice" in the_error(tmp_path / "x.npz").message
