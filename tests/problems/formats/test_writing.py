"""Files are written whole or not at all, and failing to write is told on one line."""

import io
import os
import stat
import sys
from pathlib import Path

import pytest

from alloc.problems import InputError, Instance, paper, read_instance, write_allocation, write_instance
from alloc.problems.allocation import Allocation
from alloc.problems.formats import write_bytes_atomically, write_text_atomically


def leftovers(folder: Path) -> list[str]:
    return [name for name in os.listdir(folder) if name.startswith(".alloc-")]


def test_an_interrupted_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the move fails or the user interrupts, the old content stays and nothing is left lying about."""
    path = tmp_path / "x.json"
    path.write_text("old")
    for fault in (OSError(28, "No space left on device"), KeyboardInterrupt()):

        def fail(*arguments: object, fault: BaseException = fault) -> None:
            raise fault

        monkeypatch.setattr(os, "replace", fail)
        expected = InputError if isinstance(fault, OSError) else KeyboardInterrupt
        with pytest.raises(expected):
            write_text_atomically(path, "new")
        assert path.read_text() == "old"
        assert leftovers(tmp_path) == []


def test_a_failing_disk_is_an_input_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk is told with the file and the reason, on one line."""

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match=r"x\.json: cannot be written: no space left on device$"):
        write_instance(paper(1, 0), tmp_path / "x.json")


def test_permissions(tmp_path: Path) -> None:
    """A new file gets what the umask leaves of 0666; a replaced one keeps its own."""
    before = os.umask(0o027)
    try:
        write_bytes_atomically(tmp_path / "new", b"1")
        assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o640
        (tmp_path / "new").chmod(0o604)
        write_bytes_atomically(tmp_path / "new", b"22")
        assert stat.S_IMODE((tmp_path / "new").stat().st_mode) == 0o604
        assert (tmp_path / "new").read_bytes() == b"22"
    finally:
        os.umask(before)


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    """Writing through a symbolic link replaces what it points to."""
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to("real")
    write_text_atomically(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_devices_are_written_to_not_replaced(tmp_path: Path) -> None:
    """/dev/null stays a device, and a pipe with a reader gets the bytes."""
    write_text_atomically("/dev/null", "gone")
    assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_text_atomically(tmp_path / "pipe", "through")
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("absent/x.json", "there is no folder"),
        ("absent/x.npz", "there is no folder"),
        ("absent/folder", "cannot be written"),
        ("x.yaml", "no format has the suffix '.yaml'; use .json"),
        ("x.csv", "no format has the suffix '.csv'"),
        ("file", "is a file of no known format"),
        ("folder.json", "it is a folder"),
        ("file/x.json", "cannot be written"),
        ("nul\0.json", "cannot be written"),
        ("nul\0", "cannot be written"),
        ("x" * 300 + ".json", "cannot be written: file name too long"),
        ("x" * 300, "cannot be written: file name too long"),
    ],
)
def test_where_nothing_can_be_written(tmp_path: Path, path: str, words: str) -> None:
    """Every path that cannot be written to gives one line with the path and the reason."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(InputError) as caught:
        write_instance(paper(1, 0), f"{tmp_path}/{path}")
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))
    assert str(caught.value).isprintable()
    assert leftovers(tmp_path) == []


def test_a_protected_file_is_not_replaced(bound: Path) -> None:
    """A file without write permission stays, although its folder would allow to replace it."""
    path = bound / "x.json"
    path.write_text("old")
    path.chmod(0o444)
    with pytest.raises(InputError, match="write-protected"):
        write_instance(paper(1, 0), path)
    assert path.read_text() == "old"


@pytest.mark.parametrize("path", ["x.json", "x", "x.npz"])
@pytest.mark.parametrize("field", ["name", "agent_ids", "task_ids"])
@pytest.mark.parametrize("text", ["a\0", "\ud800"])
def test_what_cannot_be_read_back_is_not_written(tmp_path: Path, path: str, field: str, text: str) -> None:
    """NUL and halves of surrogate pairs in names are refused beforehand, in every format."""
    value = text if field == "name" else [text]
    instance = Instance(ability=[1], workload=[1], **{field: value})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="must be valid Unicode without NUL"):
        write_instance(instance, tmp_path / path)
    with pytest.raises(InputError, match="must be valid Unicode without NUL"):
        write_allocation(Allocation([0]), instance, tmp_path / "plan.json")
    assert os.listdir(tmp_path) == []


def test_cells_longer_than_csv_readers_take(tmp_path: Path) -> None:
    """A list of tasks that no CSV reader takes is refused with the way out; the other formats keep it."""
    ids = [f"{'t' * 40}{j}" for j in range(4000)]
    instance = Instance(ability=[1], workload=[1] * 4000, task_ids=ids, allowed_tasks=[range(3999)])
    with pytest.raises(InputError, match=r"use \.json or \.npz"):
        write_instance(instance, tmp_path / "x")
    for file in ("x.json", "x.npz"):
        write_instance(instance, tmp_path / file)
        assert read_instance(tmp_path / file).allowed_tasks is not None


def test_existing_folders_are_updated(tmp_path: Path) -> None:
    """Writing into a folder that exists replaces the tables, and leaves other files alone."""
    (tmp_path / "fleet.v2").mkdir()
    (tmp_path / "fleet.v2" / "notes.txt").write_text("mine")
    for seed in (1, 2):
        write_instance(paper(1, seed), tmp_path / "fleet.v2")
    assert read_instance(tmp_path / "fleet.v2").name == "paper-1-seed-2"
    assert (tmp_path / "fleet.v2" / "notes.txt").read_text() == "mine"
    assert leftovers(tmp_path / "fleet.v2") == []


def test_standard_output_without_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard output that takes text only, as under contextlib.redirect_stdout, gets text."""
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    write_text_atomically("-", "Zoë")
    assert sys.stdout.getvalue() == "Zoë"  # type: ignore[attr-defined]


def test_a_reader_that_left_is_not_the_inputs_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broken pipe is passed on as such, for the program to end quietly."""

    class Closed(io.BytesIO):
        def write(self, data: object) -> int:
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(Closed()))
    with pytest.raises(BrokenPipeError):
        write_text_atomically("-", "text")
