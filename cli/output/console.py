"""Standard output, for JSON and files named ``-``, and standard error, for everything else."""

import errno
import json
import os
import sys
from collections.abc import Sequence
from typing import TextIO

from alloc.problems.text import one_line

STANDARD = "-"
"""The file name that stands for standard input and standard output."""

OUTPUT = "standard output"
"""Name of standard output in messages."""

INTERRUPTED = 130
"""Exit code after Ctrl-C, unless it ended a run with a result."""


def write_out(text: str) -> None:
    """Write to standard output; a pipe closed by its reader, as in ``| head``, is not an error.

    Raises
    ------
    OSError
        If standard output is closed, or its device is full.
    """
    if sys.stdout is None:
        raise OSError(errno.EBADF, "is closed", OUTPUT)
    _write(sys.stdout, text)


def say(text: str) -> None:
    """Write one or more lines to standard error."""
    _write(sys.stderr, text + "\n")


def note(text: str) -> None:
    """Write a note, in one line, to standard error."""
    say(f"note: {one_line(text)}")


def complain(text: str) -> None:
    """Write an error message, in one line, to standard error."""
    say(f"alloc: {one_line(text)}")


def interrupted() -> int:
    """Report that Ctrl-C ended the command before it was complete, and return the exit code."""
    complain("interrupted before it was done")
    return INTERRUPTED


def write_json(value: object) -> None:
    """Write `value` as JSON to standard output."""
    write_out(to_json(value))


def to_json(value: object) -> str:
    """Return `value` as strict JSON: in ASCII, without NaN, ending with a newline."""
    if isinstance(value, dict) and value:
        entries = (f"  {json.dumps(str(key))}: {_entry(item)}" for key, item in value.items())
        return "{\n" + ",\n".join(entries) + "\n}\n"
    return json.dumps(value, indent=2, allow_nan=False) + "\n"


def _entry(value: object) -> str:
    """Return the JSON of one value; flat objects use the C encoder, which is fast but does not indent."""
    if isinstance(value, dict) and value and set(map(type, value.values())) <= {str, type(None)}:
        flat = json.dumps(value, separators=(",\n    ", ": "))
        return "{\n    " + flat[1:-1] + "\n  }"
    return json.dumps(value, indent=2, allow_nan=False).replace("\n", "\n  ")


def table(header: Sequence[str], rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return a table with aligned columns.

    Parameters
    ----------
    left : int
        Number of leading columns that are left-aligned, as is the last; the others are right-aligned.
    """
    widths = [max(columns_of(row[column]) for row in [header, *rows]) for column in range(len(header))]

    def line(row: Sequence[str]) -> str:
        blanks = [" " * (width - columns_of(cell)) for cell, width in zip(row, widths, strict=True)]
        cells = [
            cell + blank if column < left else blank + cell
            for column, (cell, blank) in enumerate(zip(row, blanks, strict=True))
        ]
        return "  ".join(cells).rstrip()

    return "\n".join([line(header), "  ".join("-" * width for width in widths), *map(line, rows)])


def columns_of(text: str) -> int:
    """Return how many columns of a terminal a text takes: two for a wide character, none for a combining one."""
    if text.isascii():
        return len(text)
    from unicodedata import combining, east_asian_width

    return sum(0 if combining(one) else 2 if east_asian_width(one) in "WF" else 1 for one in text)


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether `stream` is a terminal; an object without `isatty` is not."""
    isatty = getattr(stream, "isatty", None)
    try:
        return isatty is not None and bool(isatty())
    except ValueError:  # it is closed
        return False


def _write(stream: TextIO | None, text: str) -> None:
    if stream is None:
        return
    try:
        try:
            stream.write(text)
        except UnicodeEncodeError:
            encoding = stream.encoding or "ascii"
            stream.write(text.encode(encoding, "backslashreplace").decode(encoding))
        flush(stream)
    except BrokenPipeError:
        _silence(stream)
    except (OSError, ValueError) as error:
        _silence(stream)  # avoids a second failure when the interpreter flushes at exit
        if stream is sys.stdout:
            number, words = errno.EBADF, "it is closed"
            if isinstance(error, OSError):
                number, words = error.errno or number, error.strerror or str(error)
            raise OSError(number, f"cannot be written: {words[:1].lower()}{words[1:]}", OUTPUT) from error


def flush(stream: TextIO) -> None:
    """Flush `stream`, if it has `flush`."""
    if hasattr(stream, "flush"):
        stream.flush()


def _silence(stream: TextIO) -> None:
    """Redirect `stream` to the null device, so that the run goes on and keeps its exit code."""
    try:
        descriptor = stream.fileno()
    except (AttributeError, OSError, ValueError):
        return  # it is closed, or not a file of the operating system
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
