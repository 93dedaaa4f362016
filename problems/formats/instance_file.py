"""Reading and writing of instances; the suffix of the path determines the format."""

import os
from pathlib import Path

from alloc.problems.arguments import of_type
from alloc.problems.errors import InputError
from alloc.problems.formats import json_text
from alloc.problems.formats.csv_folder import read_folder, write_folder
from alloc.problems.formats.document import from_document, to_document
from alloc.problems.formats.files import (
    PathLike,
    is_stream,
    named,
    read_bytes,
    read_text,
    write_bytes_atomically,
    write_text_atomically,
)
from alloc.problems.formats.messages import told
from alloc.problems.instance import Instance

KNOWN_SUFFIXES = "use .json, .npz, or a folder of CSV files"


def read_instance(path: PathLike) -> Instance:
    """Read an instance.

    Parameters
    ----------
    path : str or path
        ``*.json``, ``*.npz``, a folder with agents.csv and tasks.csv, or ``-`` for JSON from standard input.

    Returns
    -------
    Instance

    Raises
    ------
    InputError
        If it cannot be read or breaks the rules of its format; the message names source, place and correction.
    """
    source = named(path)
    try:
        if is_stream(path):
            return from_document(json_text.parse(read_text(path)))
        file, name = Path(path), name_of(path)
        suffix = file.suffix.lower()
        if suffix == ".json":
            return from_document(json_text.parse(read_text(file)), default_name=name)
        if suffix == ".npz":
            from alloc.problems.formats.npz import from_npz

            return from_npz(read_bytes(file), name)
        _require_folder(path)
        return read_folder(file, name)
    except InputError as error:
        raise told(error, source) from error.__cause__


def name_of(path: PathLike) -> str:
    """Return the default name of an instance from its path; undecodable bytes become U+FFFD."""
    file = Path(path)
    stem = file.stem if file.suffix.lower() in (".json", ".npz") else Path(os.path.abspath(file)).name
    return os.fsencode(stem).decode("utf-8", "replace")


def write_instance(instance: Instance, path: PathLike) -> None:
    """Write an instance, which `read_instance` restores exactly.

    Parameters
    ----------
    instance : Instance
    path : str or path
        ``*.json``, ``*.npz``, a folder (a path without suffix, or an existing folder) for CSV files, or ``-`` for JSON
        to standard output; pipes, devices and open descriptors such as ``/dev/stdout`` get JSON, too. An existing file
        is replaced atomically.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    source = named(path, output=True)
    of_type(instance, Instance, "instance")
    try:
        _write(instance, path)
    except InputError as error:
        raise told(error, source) from error.__cause__


def _write(instance: Instance, path: PathLike) -> None:
    file = Path(path)
    suffix = file.suffix.lower()
    if not os.fspath(path):
        raise InputError("is not a file name")  # Path("") would be the working folder
    if is_stream(path) or suffix == ".json" or _is_device(path):
        write_text_atomically(path, json_text.lines(to_document(instance)))
    elif suffix == ".npz":
        from alloc.problems.formats.npz import to_npz

        write_bytes_atomically(path, to_npz(instance))
    elif _is_folder(path) or (not suffix and not os.path.lexists(path)) or os.fspath(path).endswith(os.sep):
        write_folder(instance, file)
    elif os.path.lexists(path):
        raise InputError(f"is a file of no known format; {KNOWN_SUFFIXES}")
    else:
        raise InputError(f"no format has the suffix {suffix!r}; {KNOWN_SUFFIXES}")


def _is_device(path: PathLike) -> bool:
    """Return whether the path exists and is a pipe or a device, whose suffix does not matter."""
    try:
        return os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path)
    except ValueError:  # a NUL in the path
        return False


def _is_folder(path: PathLike) -> bool:
    try:
        return os.path.isdir(path)
    except ValueError:  # a NUL in the path
        return False


def _require_folder(path: PathLike) -> None:
    if _is_folder(path):
        return
    suffix = Path(path).suffix
    if suffix == ".csv":
        raise InputError(
            "is a single table; give a folder with agents.csv and tasks.csv, or combine two tables with `alloc import`"
        )
    try:
        exists = os.path.lexists(path)
    except ValueError:
        exists = False
    if not exists:
        raise InputError("there is no such file or folder; check the path")
    raise InputError(f"has no known format; {KNOWN_SUFFIXES}")
