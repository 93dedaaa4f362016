"""What can be wrong with the file of a store, in a line each."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from alloc.problems import InputError
from alloc.problems.formats.messages import one_line

BUSY_S = 30.0
"""Seconds for which a lock of another program is waited out."""

MEANINGS = {
    "SQLITE_FULL": "cannot be written: the disk is full; what it holds is kept, so make room and call this again",
    "SQLITE_READONLY": "cannot be written: it, or its folder, is read-only; change its permissions",
    "SQLITE_PERM": "may not be opened; change its permissions",
    "SQLITE_CANTOPEN": "cannot be opened; check the path, its folder, and the permissions of both",
    "SQLITE_BUSY": f"has been locked by another program for {BUSY_S:g} s; end that, and call this again",
    "SQLITE_LOCKED": "is locked by another program; end that, and call this again",
    "SQLITE_PROTOCOL": "is locked by another program; end that, and call this again",
    "SQLITE_NOTADB": "is not a store of runs; name another file",
    "SQLITE_CORRUPT": "is damaged; `sqlite3 FILE .recover` saves what can be read",
    "SQLITE_IOERR": "cannot be read or written: the disk or the file system fails, or is full; what it holds is kept",
    "SQLITE_TOOBIG": "cannot be written: a row is too large",
}
"""What to say of each primary error code of SQLite."""


@contextmanager
def explained(path: str) -> Iterator[None]:
    """Turn the errors of SQLite into an `InputError` of one line about the file."""
    try:
        yield
    except sqlite3.Error as error:
        name = str(getattr(error, "sqlite_errorname", ""))
        primary = "_".join(name.split("_")[:2])
        words = MEANINGS.get(primary, f"cannot be used: {one_line(str(error))}")
        raise InputError(words, source=path) from error
