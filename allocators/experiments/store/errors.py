"""One-line error messages for problems with the file of a store."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from alloc.problems import InputError
from alloc.problems.formats.messages import message_line

BUSY_S = 30.0
"""Seconds to wait for a lock of another program."""

MEANINGS = {
    "SQLITE_FULL": "cannot be written: the disk is full; its contents are kept, so free some space and try again",
    "SQLITE_READONLY": "cannot be written: the file or its folder is read-only; change the permissions",
    "SQLITE_PERM": "cannot be opened: permission denied; change its permissions",
    "SQLITE_CANTOPEN": "cannot be opened; check the path, its folder, and their permissions",
    "SQLITE_BUSY": f"has been locked by another program for {BUSY_S:g} s; end that program and try again",
    "SQLITE_LOCKED": "is locked by another program; end that program and try again",
    "SQLITE_PROTOCOL": "is locked by another program; end that program and try again",
    "SQLITE_NOTADB": "is not a store of runs; name another file",
    "SQLITE_CORRUPT": "is damaged; `sqlite3 FILE .recover` extracts what is still readable",
    "SQLITE_IOERR": "cannot be read or written: the disk or file system failed or is full; its contents are kept",
    "SQLITE_TOOBIG": "cannot be written: a row is too large",
}
"""Message for each primary error code of SQLite."""


def _unopened(path: Path) -> str | None:
    """Return why a file cannot be opened, where its name tells it."""
    if path.is_dir():
        return "is a folder where a file is expected"
    if not path.parent.exists():
        return f"there is no folder {message_line(str(path.parent))!r}; create it first"
    return None


@contextmanager
def explained(path: str) -> Iterator[None]:
    """Convert errors of SQLite within this context into an `InputError` of one line about the file."""
    try:
        yield
    except sqlite3.Error as error:
        name = str(getattr(error, "sqlite_errorname", ""))
        primary = "_".join(name.split("_")[:2])
        words = MEANINGS.get(primary, f"cannot be used: {message_line(str(error))}")
        if primary == "SQLITE_CANTOPEN":
            words = _unopened(Path(path)) or words
        raise InputError(words, source=path) from error
