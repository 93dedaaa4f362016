"""Files that commands read, and those that they are to write, looked at before a long run."""

import os
from collections.abc import Callable
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
