"""Files are written atomically, and failures are one line."""

import errno
import io
import os
import stat
import sys
from pathlib import Path
from typing import Any

import pytest

from alloc.problems import InputError, Instance, paper, read_instance, write_allocation, write_instance
from alloc.problems.allocation import Allocation
from alloc.problems.formats import check_writable, write_bytes_atomically, write_text_atomically


def leftovers(folder: Path) -> list[str]:
    return [name for name in os.listdir(folder) if name.startswith(".alloc-")]


def test_interrupted_write_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If renaming fails or the user interrupts, the old content is kept and no temporary file is left."""
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


def test_failing_disk_is_an_input_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk is reported with the file and the reason, in one line."""

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match=r"x\.json: cannot be written: no space left on device$"):
        write_instance(paper(1, 0), tmp_path / "x.json")


def test_file_permissions(tmp_path: Path) -> None:
    """A new file gets mode 0666 minus the umask; a replaced one keeps its mode."""
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


def test_symbolic_links_are_followed(tmp_path: Path) -> None:
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
def test_unwritable_paths_are_reported(tmp_path: Path, path: str, words: str) -> None:
    """Every path that is not writable gives one line with the path and the reason."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(InputError) as caught:
        write_instance(paper(1, 0), f"{tmp_path}/{path}")
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path))
    assert str(caught.value).isprintable()
    assert leftovers(tmp_path) == []


def test_write_protected_file_is_not_replaced(bound: Path) -> None:
    """A file without write permission is not replaced, although its folder would allow it."""
    path = bound / "x.json"
    path.write_text("old")
    path.chmod(0o444)
    with pytest.raises(InputError, match="write-protected"):
        write_instance(paper(1, 0), path)
    assert path.read_text() == "old"


@pytest.mark.parametrize("path", ["x.json", "x", "x.npz"])
@pytest.mark.parametrize("field", ["name", "agent_ids", "task_ids"])
@pytest.mark.parametrize("text", ["a\0", "\ud800"])
def test_unreadable_names_are_not_written(tmp_path: Path, path: str, field: str, text: str) -> None:
    """NUL and lone surrogates in names are refused before writing, in every format."""
    value = text if field == "name" else [text]
    instance = Instance(ability=[1], workload=[1], **{field: value})  # type: ignore[arg-type]
    with pytest.raises(InputError, match="must be valid Unicode without NUL"):
        write_instance(instance, tmp_path / path)
    with pytest.raises(InputError, match="must be valid Unicode without NUL"):
        write_allocation(Allocation([0]), instance, tmp_path / "plan.json")
    assert os.listdir(tmp_path) == []


def test_cells_too_long_for_csv_readers_are_refused(tmp_path: Path) -> None:
    """A list of tasks that is too long for CSV readers is refused with an alternative; other formats keep it."""
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


def test_text_only_standard_output_gets_text(monkeypatch: pytest.MonkeyPatch) -> None:
    """Standard output that takes text only, as under contextlib.redirect_stdout, gets text."""
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    write_text_atomically("-", "Zoë")
    assert sys.stdout.getvalue() == "Zoë"  # type: ignore[attr-defined]


def test_broken_pipe_is_passed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """A broken pipe is passed on as such, for the program to end quietly."""

    class Closed(io.BytesIO):
        def write(self, data: object) -> int:
            raise BrokenPipeError

    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(Closed()))
    with pytest.raises(BrokenPipeError):
        write_text_atomically("-", "text")


@pytest.mark.parametrize("step", ["open", "replace"])
@pytest.mark.parametrize("number", [errno.EBUSY, errno.EACCES, errno.EROFS, errno.EXDEV, errno.EPERM])
def test_files_that_cannot_be_renamed_are_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str, number: int
) -> None:
    """A file that is a mount point, or in a read-only folder, is overwritten, and longer content is truncated."""
    path, real = tmp_path / "x", os.open
    path.write_text("what was there before")
    inode = path.stat().st_ino

    def fail(name: object, *arguments: Any) -> int:
        if step == "replace" or ".alloc-" in str(name):
            raise OSError(number, os.strerror(number))
        return real(name, *arguments)  # type: ignore[arg-type]

    check_writable(path)
    monkeypatch.setattr(os, step, fail)
    write_text_atomically(path, "new")
    assert (path.read_text(), path.stat().st_ino) == ("new", inode)
    assert leftovers(tmp_path) == []


def test_full_disk_keeps_the_content_of_overwritten_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If there is not enough space, the old content is kept, also for files overwritten in place."""

    def fail(number: int) -> None:
        raise OSError(number, os.strerror(number))

    path = tmp_path / "x"
    path.write_text("old")
    monkeypatch.setattr(os, "replace", lambda *_: fail(errno.EBUSY))
    monkeypatch.setattr(os, "posix_fallocate", lambda *_: fail(errno.ENOSPC))
    with pytest.raises(InputError, match="no space left on device"):
        write_text_atomically(path, "new and longer")
    assert path.read_text() == "old"


@pytest.mark.parametrize("name", ["/dev/fd/{}", "/proc/self/fd/{}", "link", "link.json"])
@pytest.mark.parametrize("mode", ["ab", "wb"])
def test_open_descriptors_are_written_at_their_position(tmp_path: Path, name: str, mode: str) -> None:
    """Earlier content of an open file is kept, with and without append mode, and the file is not replaced."""
    (tmp_path / "log").write_text("before\n")
    with (tmp_path / "log").open(mode) as log:
        log.write(b"earlier\n")
        log.flush()
        if "link" in name:
            (tmp_path / name).symlink_to(f"/dev/fd/{log.fileno()}")
        path = tmp_path / name.format(log.fileno())
        check_writable(path)
        write_text_atomically(path, "one\n")
        write_instance(paper(1, 0), path)
        log.write(b"later\n")
    lines = (tmp_path / "log").read_text().splitlines()
    first = ["before"] if mode == "ab" else []
    assert lines[: len(first) + 2] == [*first, "earlier", "one"]
    assert lines[-1] == "later"
    assert '"format": "alloc-instance/1"' in "".join(lines)


def test_pipes_without_a_suffix_get_json(tmp_path: Path) -> None:
    """Process substitutions of a shell and named pipes get JSON, as standard output does."""
    begin, end = os.pipe()
    write_instance(Instance(ability=[1], workload=[1]), f"/dev/fd/{end}")
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_instance(Instance(ability=[1], workload=[1]), tmp_path / "pipe")
    assert os.read(begin, 10_000) == os.read(reader, 10_000) != b""
    write_instance(Instance(ability=[1], workload=[1]), f"/dev/fd/{end}")
    os.close(end)
    assert read_instance(f"/proc/self/fd/{begin}").n == 1
    for descriptor in (begin, reader):
        os.close(descriptor)


def test_unwritable_descriptors_are_found_before_writing(tmp_path: Path) -> None:
    """A closed or read-only descriptor gives the same error on checking and on writing."""
    begin, end = os.pipe()
    os.close(end)
    for number in (begin, end):
        for attempt in (check_writable, lambda path: write_text_atomically(path, "text")):
            with pytest.raises(InputError, match="cannot be written: "):
                attempt(f"/dev/fd/{number}")
    os.close(begin)


@pytest.mark.parametrize("path", ["absent/x.json", "folder.json", "file/x.json", "nul\0.json", "x" * 300 + ".json"])
def test_check_before_a_run_matches_writing(tmp_path: Path, path: str) -> None:
    """The check before a run gives the same errors as writing, and leaves no files."""
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.json").mkdir()
    told = []
    for attempt in (check_writable, lambda path: write_text_atomically(path, "text")):
        with pytest.raises(InputError) as caught:
            attempt(f"{tmp_path}/{path}")
        told.append(str(caught.value))
    assert told[0] == told[1]
    check_writable(tmp_path / "new")
    assert sorted(os.listdir(tmp_path)) == ["file", "folder.json"]
