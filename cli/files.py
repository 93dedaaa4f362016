"""Files that commands read, and those that they are to write, looked at before a long run."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from alloc.cli.console import STANDARD, note, to_json, write_out

if TYPE_CHECKING:
    from alloc.problems import Allocation, Instance


def read_pair(instance: str, allocation: str | None, *, quiet: bool = False) -> "tuple[Instance, Allocation | None]":
    """Read an instance, and an allocation of it if there is one; another instance's name is worth a note."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_allocation, read_instance

    if instance == allocation == STANDARD:
        raise InputError("cannot be the instance and the allocation at once", source="standard input")
    problem = read_instance(instance)
    if allocation is None:
        return problem, None
    answer, warning = read_allocation(allocation, problem)
    if warning is not None and not quiet:
        note(warning)
    return problem, answer


def read_known(instance: str, front: str | None, *, quiet: bool = False) -> "tuple[Instance, list[Allocation]]":
    """Read an instance, and all allocations of it in a file: one, or those of a front."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_allocations, read_instance

    if instance == front == STANDARD:
        raise InputError("cannot be the instance and the start at once", source="standard input")
    problem = read_instance(instance)
    if front is None:
        return problem, []
    answers, warning = read_allocations(front, problem)
    if warning is not None and not quiet:
        note(warning)
    return problem, answers


def save(document: Callable[[], dict[str, Any]], output: str | None, *, json: bool) -> None:
    """Write what `document` returns as JSON to the file asked for, whole or not at all, and to standard output."""
    text = to_json(document()) if json or output is not None else ""
    if output is not None and output != STANDARD:
        from alloc.problems.formats import write_text_atomically

        write_text_atomically(output, text)
    if json or output == STANDARD:
        write_out(text)


Named = tuple[str, str | None]
"""An argument or option, and the file that it names, if any."""


def check_outputs(*written: Named, read: Iterable[Named] = ()) -> None:
    """Raise an `InputError` if a file cannot be written, or is one that is read or that another option writes.

    What is replaced on purpose, as by ``--start FILE --output FILE``, is not to be in `read`.
    """
    from alloc.problems import InputError

    taken = {path: option for option, name in read if name for path in _parts(name)}
    for option, name in written:
        check_writable(name)
        if name is None or name == STANDARD or not _may_be_replaced(name):
            continue
        other = taken.setdefault(os.path.realpath(name), option)
        if other != option:
            raise InputError(f"is {other} and {option} at once; name another file", source=name)


def _parts(name: str) -> list[str]:
    """Return the places of the files that an instance may be read from; all of its tables if it is a folder."""
    tables = ("agents.csv", "tasks.csv", "instance.json") if os.path.isdir(name) else ()
    return [os.path.realpath(name), *(os.path.realpath(os.path.join(name, table)) for table in tables)]


def _may_be_replaced(name: str) -> bool:
    """Whether it is a file, or will be: a device such as /dev/null may be written by many."""
    return os.path.isfile(name) or not os.path.exists(name)


def check_writable(name: str | None) -> None:
    """Raise an `InputError` if the file cannot be written as far as that can be told."""
    if name is None or name == STANDARD:
        return
    from alloc.problems import InputError

    if not name:
        raise InputError("is no name of a file; give one", source="''")
    path = Path(name)
    folder = path.parent
    if path.is_dir():
        raise InputError("is a folder; name a file in it", source=name)
    if not folder.is_dir():
        raise InputError(f"there is no folder {str(folder)!r}; create it first", source=name)
    if not os.access(path if path.exists() else folder, os.W_OK):
        raise InputError("may not be written; choose another place", source=name)
