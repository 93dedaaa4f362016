"""Bytes and text from files and standard input, and to files and standard output."""

import os
import secrets
import stat
import sys
from pathlib import Path

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats.messages import one_line

STANDARD_STREAM = "-"

PathLike = str | os.PathLike[str]


def named(path: PathLike, *, output: bool = False) -> str:
    """Return what messages call `path`."""
    text = os.fspath(of_type(path, (str, os.PathLike), "path"))
    if text == STANDARD_STREAM:
        return "standard output" if output else "standard input"
    return one_line(text, 4096) or "''"


def is_stream(path: PathLike) -> bool:
    """Whether `path` is open already: ``-``, ``/dev/stdin``, or what a shell makes of ``<(command)``."""
    text = os.fspath(path)
    return text in (STANDARD_STREAM, "/dev/stdin") or text.startswith("/dev/fd/")


def read_bytes(path: PathLike) -> bytes:
    """Return all of a file, or of standard input where `path` is ``-``.

    Raises
    ------
    InputError
        If there is no such file, it is no regular file, or it cannot be read.
    """
    source = named(path)
    try:
        if os.fspath(path) == STANDARD_STREAM:
            return _standard_input()
        if not is_stream(path):
            _refuse_unless_regular(os.stat(path).st_mode, source)
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError("there is no such file; check the path", source=source) from error
    except PermissionError as error:
        raise InputError("may not be read; change its permissions", source=source) from error
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"cannot be read: {reason(error)}", source=source) from error
    except MemoryError as error:
        raise InputError("does not fit into memory", source=source) from error


def read_text(path: PathLike) -> str:
    """Return the text of a UTF-8 file, with or without a byte order mark; ``-`` is standard input.

    Raises
    ------
    InputError
        As `read_bytes`, and if the file is not UTF-8.
    """
    data = read_bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"is not UTF-8 (byte 0x{data[error.start]:02x}); save it as UTF-8"
        raise InputError(message, f"line {line}", named(path)) from error


def write_text_atomically(path: PathLike, text: str) -> None:
    """Write a UTF-8 file whole or not at all; see `write_bytes_atomically`."""
    try:
        data = text.encode("utf-8")
    except UnicodeEncodeError as error:
        message = f"cannot be written: {text[error.start]!r} is half a character, and no UTF-8"
        raise InputError(message, source=named(path, output=True)) from error
    write_bytes_atomically(path, data)


def write_bytes_atomically(path: PathLike, data: bytes) -> None:
    """Write a file whole or not at all; ``-`` is standard output.

    The file is written beside its place and then moved there, so that an existing file is either replaced or left as
    it was. It keeps the permissions of the file that it replaces. Devices and pipes are written directly.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    source = named(path, output=True)
    try:
        if os.fspath(path) == STANDARD_STREAM:
            _write_standard_output(data)
        else:
            _replace(Path(os.path.realpath(path)), data)
    except BrokenPipeError:
        raise  # whoever read has left: no fault of the input
    except FileNotFoundError as error:
        folder = one_line(os.path.dirname(os.fspath(path)) or ".")
        raise InputError(f"cannot be written: there is no folder {folder!r}; create it first", source=source) from error
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"cannot be written: {reason(error)}", source=source) from error


def _refuse_unless_regular(mode: int, source: str) -> None:
    if stat.S_ISDIR(mode):
        raise InputError("is a folder where a file is expected", source=source)
    if not stat.S_ISREG(mode):
        raise InputError("is a pipe or device, not a file; pipe it in with -", source=source)


def _standard_input() -> bytes:
    if sys.stdin is None:
        raise InputError("is closed", source="standard input")
    raw = getattr(sys.stdin, "buffer", None)
    data = raw.read() if raw is not None else sys.stdin.read()
    return data if isinstance(data, bytes) else data.encode("utf-8", "surrogatepass")


def _write_standard_output(data: bytes) -> None:
    if sys.stdout is None:
        raise InputError("is closed", source="standard output")
    sys.stdout.flush()
    raw = getattr(sys.stdout, "buffer", None)
    if raw is not None:
        raw.write(data)
        raw.flush()
    else:
        sys.stdout.write(data.decode("utf-8"))


def _replace(target: Path, data: bytes) -> None:
    """Write beside `target` and move; mode 0666 less the umask is what open() would give a new file."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        mode = None
    if mode is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(21, "it is a folder")
    if mode is not None and not stat.S_ISREG(mode):
        target.write_bytes(data)
        return
    if mode is not None and not os.access(target, os.W_OK):
        raise PermissionError(13, "it is write-protected")
    beside = target.parent / f".alloc-{secrets.token_hex(8)}.tmp"
    try:
        with os.fdopen(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666), "wb") as file:
            file.write(data)
        if mode is not None:
            os.chmod(beside, stat.S_IMODE(mode))
        os.replace(beside, target)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise


def reason(error: Exception) -> str:
    """Return the words of a system error, to stand after a colon."""
    words = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return one_line(words[0].lower() + words[1:])
