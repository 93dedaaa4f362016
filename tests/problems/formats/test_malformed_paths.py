"""Paths without a readable file are one-line errors."""

import os
import stat
import sys
from pathlib import Path

import pytest

from alloc.problems import InputError, Instance, read_allocation, read_instance, write_instance

from .conftest import the_error

VALID = "{}"

PATHS = [
    ("absent.json", "there is no such file; check the path"),
    ("absent.npz", "there is no such file; check the path"),
    ("absent", "there is no such file or folder; check the path"),
    ("absent/x.json", "there is no such file"),
    ("folder.json", "is a folder where a file is expected"),
    ("folder.npz", "is a folder where a file is expected"),
    ("folder", "there is no such file; check the path"),
    ("pipe.json", "is a pipe or device, not a file; pipe it in with -"),
    ("pipe.npz", "is a pipe or device, not a file"),
    ("pipe", "has no known format; use .json, .npz, or a folder"),
    ("null.json", "is a pipe or device"),
    ("loop.json", "cannot be read"),
    ("plain.txt", "has no known format; use .json, .npz, or a folder"),
    ("plain", "has no known format"),
    ("agents.csv", "give a folder with agents.csv and tasks.csv"),
    ("plain/x.json", "cannot be read: not a directory"),
    ("latin.json", "is not UTF-8 (byte 0xeb); save it as UTF-8"),
    ("utf16.json", "is not UTF-8 (byte 0xff); save it as UTF-8"),
    ("nul\0.json", "cannot be read"),
    ("nul\0", "there is no such file"),
    ("x" * 300 + ".json", "cannot be read: file name too long"),
    ("new\nline.json", "there is no such file"),
]


@pytest.mark.parametrize(("path", "words"), PATHS)
def test_invalid_paths_are_refused(tmp_path: Path, path: str, words: str) -> None:
    """Files of the wrong kind, or missing ones, are reported as such, without waiting on a pipe."""
    for name in ("folder.json", "folder.npz", "folder"):
        (tmp_path / name).mkdir()
    for name in ("pipe.json", "pipe.npz", "pipe"):
        os.mkfifo(tmp_path / name)
    for name in ("plain.txt", "plain", "agents.csv"):
        (tmp_path / name).write_text("text")
    (tmp_path / "null.json").symlink_to("/dev/null")
    (tmp_path / "loop.json").symlink_to("loop.json")
    (tmp_path / "latin.json").write_bytes('{"format": "Zoë"}'.encode("latin-1"))
    (tmp_path / "utf16.json").write_bytes(VALID.encode("utf-16"))
    with pytest.raises(InputError) as caught:
        read_instance(tmp_path / path)
    assert words in caught.value.message
    assert str(caught.value).isprintable()
    assert str(caught.value).startswith(str(tmp_path))


def test_devices_are_refused() -> None:
    """The null device causes neither waiting nor a traceback."""
    assert "has no known format" in the_error("/dev/null").message
    instance = Instance(ability=[1], workload=[1])
    assert "is a pipe or device" in the_error("/dev/null", lambda path: read_allocation(path, instance)).message


@pytest.mark.parametrize("file", ["x.json", "x.npz", "x"])
def test_unreadable_files_are_reported(bound: Path, file: str, full: Instance) -> None:
    """Missing permissions are reported with a correction."""
    path = bound / file
    write_instance(full, path)
    locked = path / "agents.csv" if path.is_dir() else path
    locked.chmod(0)
    try:
        assert "cannot be read: permission denied; change its permissions" in the_error(path).message
    finally:
        locked.chmod(stat.S_IRUSR | stat.S_IWUSR)


def test_system_errors_on_reading_are_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Errors of the system on reading become one line, and so does lack of memory."""
    (tmp_path / "x.json").write_text("{}")
    for fault, words in (
        (PermissionError(13, "Permission denied"), "cannot be read: permission denied; change its permissions"),
        (OSError(5, "Input/output error"), "cannot be read: input/output error"),
        (MemoryError(), "does not fit into memory"),
    ):

        def fail(path: Path, fault: BaseException = fault) -> bytes:
            raise fault

        monkeypatch.setattr(Path, "read_bytes", fail)
        assert the_error(tmp_path / "x.json").message == words


def test_closed_standard_input_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """A closed standard input is reported."""
    monkeypatch.setattr(sys, "stdin", None)
    assert the_error("-").message == "is closed"
