"""Reading and writing of bytes and text, with files and standard streams."""

import errno
import os
import secrets
import stat
import sys
from pathlib import Path

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats.messages import message_line, reason, unwritable

STANDARD_STREAM = "-"

PathLike = str | os.PathLike[str]

_MAX_LINKS = 40
"""Maximum number of symbolic links to follow, as in the kernel."""

_NO_MOVE = {
    errno.EACCES,
    errno.EBUSY,
    errno.ENAMETOOLONG,
    errno.ENOTSUP,
    errno.EPERM,
    errno.EROFS,
    errno.EXDEV,
}
"""Errors if no file can be created in or moved to a folder, as it is read-only or the file is a mount point."""


def named(path: PathLike, *, output: bool = False) -> str:
    """Return the name of `path` in messages."""
    of_type(path, (str, os.PathLike), "path")
    text = os.fspath(path)
    if text == STANDARD_STREAM:
        return "standard output" if output else "standard input"
    return message_line(text, 4096) or "''"


def is_stream(path: PathLike) -> bool:
    """Return whether `path` is already open: ``-``, ``/dev/stdin``, or a shell's process substitution."""
    return os.fspath(path) == STANDARD_STREAM or open_descriptor(path) is not None


def open_descriptor(path: PathLike) -> int | None:
    """Return N for ``/dev/fd/N``, ``/proc/self/fd/N`` or a link to one, such as ``/dev/stdout``; else None."""
    text = os.fspath(path)
    own = {os.path.realpath(folder) for folder in ("/dev/fd", "/proc/self/fd", "/proc/thread-self/fd")}
    try:
        for _ in range(_MAX_LINKS):
            folder, name = os.path.split(text)
            if name.isdecimal() and os.path.realpath(folder) in own:
                return int(name)
            if not os.path.islink(text):
                break
            text = os.path.join(folder, os.readlink(text))
    except (OSError, ValueError):
        pass  # a NUL in the path
    return None


def is_standard_output(path: PathLike) -> bool:
    """Return whether `path` is ``-`` or the descriptor of standard output."""
    return os.fspath(path) == STANDARD_STREAM or open_descriptor(path) == 1


def read_bytes(path: PathLike) -> bytes:
    """Return the content of a file, or of standard input if `path` is ``-``.

    Raises
    ------
    InputError
        If the file does not exist, is not a regular file, or cannot be read.
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
        raise InputError("cannot be read: permission denied; change its permissions", source=source) from error
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
        As for `read_bytes`, or if the file is not UTF-8.
    """
    data = read_bytes(path)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        message = f"is not UTF-8 (byte 0x{data[error.start]:02x}); save it as UTF-8"
        raise InputError(message, f"line {line}", named(path)) from error


def write_text_atomically(path: PathLike, text: str) -> None:
    """Write a UTF-8 file atomically; see `write_bytes_atomically`."""
    try:
        data = text.encode("utf-8")
    except UnicodeEncodeError as error:
        message = f"cannot be written: {text[error.start]!r} is a lone surrogate, which UTF-8 cannot encode"
        raise InputError(message, source=named(path, output=True)) from error
    write_bytes_atomically(path, data)


def write_bytes_atomically(path: PathLike, data: bytes) -> None:
    """Write a file atomically; ``-`` is standard output.

    The data are written to a temporary file in the same folder, which is then renamed, so that an existing file is
    either replaced or unchanged. The permissions of a replaced file are kept. If the folder does not allow this, the
    file is overwritten in place, after making sure of enough space. Devices, pipes and open descriptors are written
    directly.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    source = named(path, output=True)
    try:
        descriptor = open_descriptor(path)
        if os.fspath(path) == STANDARD_STREAM:
            _write_standard_output(data)
        elif descriptor is not None:
            _write_descriptor(descriptor, data)
        else:
            _write_file(Path(os.path.realpath(path)), data)
    except (OSError, ValueError) as error:
        if isinstance(error, BrokenPipeError) and is_standard_output(path):
            raise  # the reader of a pipe has closed it, which is not an input error
        raise unwritable(error, path, source) from error


def check_writable(path: PathLike) -> None:
    """Raise an `InputError` if `write_bytes_atomically` would fail, by the same steps but without data.

    An existing file is not changed; a missing one is created and removed again.
    """
    source = named(path, output=True)
    try:
        descriptor = open_descriptor(path)
        if descriptor is not None:
            _check_descriptor(descriptor)
        elif os.fspath(path) == STANDARD_STREAM:
            _require_standard_output()
        else:
            target = Path(os.path.realpath(path))
            if _mode(target) is None:
                os.close(os.open(target, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
                target.unlink()
    except (OSError, ValueError) as error:
        raise unwritable(error, path, source) from error


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


def _require_standard_output() -> None:
    if sys.stdout is None:
        raise InputError("is closed", source="standard output")


def _write_standard_output(data: bytes) -> None:
    _require_standard_output()
    _flush(sys.stdout)
    raw = getattr(sys.stdout, "buffer", None)
    if raw is not None:
        raw.write(data)
        raw.flush()
    else:
        sys.stdout.write(data.decode("utf-8"))
        _flush(sys.stdout)


def _flush(stream: object) -> None:
    flush = getattr(stream, "flush", None)  # replacements of streams may lack it
    if flush is not None:
        flush()


def _write_descriptor(descriptor: int, data: bytes) -> None:
    """Write at the current position of the descriptor, or at the end if it appends, without truncation."""
    _check_descriptor(descriptor)
    for stream in (sys.stdout, sys.stderr):
        _flush(stream)  # keep the order of earlier output
    left = memoryview(data)
    while left:
        left = left[os.write(descriptor, left) :]


def _check_descriptor(descriptor: int) -> None:
    import fcntl  # exists on all systems with /dev/fd

    if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, "it is open for reading only")


def _mode(target: Path) -> int | None:
    """Return the mode of the target, None if it does not exist; raise an error if it is not writable."""
    try:
        mode = target.stat().st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder")
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, "it is write-protected")
    return mode


def _write_file(target: Path, data: bytes) -> None:
    mode = _mode(target)
    if mode is not None and not stat.S_ISREG(mode):
        target.write_bytes(data)
        return
    try:
        _replace(target, data, mode)
    except OSError as error:
        if mode is None or error.errno not in _NO_MOVE:
            raise
        _overwrite(target, data)


def _replace(target: Path, data: bytes, mode: int | None) -> None:
    """Write a temporary file and rename it to `target`; new files get mode 0666 minus the umask, as by open()."""
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


def _overwrite(target: Path, data: bytes) -> None:
    """Overwrite an existing file; space is reserved first, so that a full disk leaves the old content intact."""
    with os.fdopen(os.open(target, os.O_WRONLY), "wb") as file:
        size = os.fstat(file.fileno()).st_size
        if data and hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(file.fileno(), 0, len(data))
            except OSError as error:
                file.truncate(size)
                if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
                    raise
        file.write(data)
        file.truncate(len(data))
