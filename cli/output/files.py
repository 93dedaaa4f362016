"""Files that commands read and write; output files are checked before a long run."""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from alloc.cli.output.console import STANDARD, note, say, write_out

if TYPE_CHECKING:
    from alloc.problems import Allocation, Instance


def read_pair(instance: str, allocation: str) -> "tuple[Instance, Allocation, dict[str, object]]":
    """Read an instance and a plan for it; print a note if the plan names another instance.

    The third value has the unverified claims of a result file about its plan; it is empty for a plan alone.
    """
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance, read_plan

    if instance == allocation == STANDARD:
        raise InputError("cannot be the instance and the allocation at once", source="standard input")
    problem = read_instance(instance)
    plan = read_plan(allocation, problem)
    answer, warning = plan.allocation(problem)
    if warning is not None:
        note(warning)
    return problem, answer, plan.result


def read_instances(name: str) -> "list[Instance]":
    """Read an instance, or all instances in a folder."""
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    folder = Path(name)
    if not folder.is_dir() or (folder / "agents.csv").exists():
        return [read_instance(name)]
    found = [path for path in sorted(folder.iterdir()) if path.suffix in (".json", ".npz") or path.is_dir()]
    if not found:
        raise InputError("contains no instances", source=name)
    return [read_instance(str(path)) for path in found]


def read_known(instance: str, front: str | None, *, quiet: bool = False) -> "tuple[Instance, list[Allocation]]":
    """Read an instance and the allocations for it in a file: a single one, or those of a front."""
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


def save(
    found: Callable[[], str],
    output: str | None,
    shown: Callable[[], str] | None = None,
    then: Iterable[Callable[[], object]] = (),
    content: Callable[[], bytes] | None = None,
) -> None:
    """Write the result of a run to a file and to standard output, then take further steps, such as drawing it.

    If a step fails, the others are still taken. A result that could not be written anywhere is printed to standard
    output, or to standard error if that fails.

    Parameters
    ----------
    found, shown : callable
        Return the text for `output`, and for standard output, if any; called when needed.
    output : str or None
        Name of a file, or ``-``.
    then : iterable of callable
        Further steps, such as printing a summary and drawing.
    content : callable, optional
        Returns the content of the file if it is not the text of `found`.

    Raises
    ------
    InputError, OSError
        The first failure, after all other steps.
    """
    from alloc.problems.formats import is_standard_output, write_bytes_atomically, write_text_atomically

    to_standard_output = output is not None and is_standard_output(output)
    steps: list[Callable[[], None]] = []
    if output is not None and not to_standard_output:
        if content is None:
            steps.append(lambda: write_text_atomically(output, found()))
        else:
            steps.append(lambda: write_bytes_atomically(output, content()))
    printed = found if to_standard_output else shown
    if printed is not None:
        steps.append(lambda: write_out(printed()))
    failures = [_failure(step) for step in steps]
    is_kept = None in failures
    failures += [_failure(step) for step in then]
    for failure in filter(None, failures):
        # do not retry standard output after a failure
        if not is_kept and (printed is not None or _failure(lambda: write_out(found())) is not None):
            say(found())
        raise failure


def _failure(step: Callable[[], object]) -> Exception | None:
    """Take a step, and return its exception, or None if it succeeded."""
    try:
        step()
    except Exception as error:
        return error
    return None


Named = tuple[str, str | None]
"""Name of an argument or option, and its file, if any."""


def check_outputs(*written: Named, read: Iterable[Named] = ()) -> None:
    """Raise an `InputError` if an output file cannot be written, is also read, or is written by another option.

    Files that may be replaced on purpose, as by ``--start FILE --output FILE``, do not belong in `read`.
    """
    from alloc.problems import InputError

    taken = {path: option for option, name in read if name for path in _parts(name)}
    for option, name in written:
        check_output(name)
        if name is None or name == STANDARD or not _may_be_replaced(name):
            continue
        other = taken.setdefault(os.path.realpath(name), option)
        if other != option:
            raise InputError(f"is {other} and {option} at once; name another file", source=name)


def _parts(name: str) -> list[str]:
    """Return the paths that an instance is read from: the path itself and, for a folder, its tables."""
    from alloc.problems.formats.csv_folder import FILES

    tables = FILES if os.path.isdir(name) else ()
    return [os.path.realpath(name), *(os.path.realpath(os.path.join(name, table)) for table in tables)]


def _may_be_replaced(name: str) -> bool:
    """Return whether writing may replace a regular file; a device such as /dev/null may be written twice."""
    return os.path.isfile(name) or not os.path.exists(name)


def check_result(path: str | None, instance: "Instance | None" = None) -> None:
    """Raise an error if a result is to be written and the suffix is unknown or does not fit the instance."""
    if path is not None:
        from alloc.allocators.plan.files import check_result_file, suffix_of

        if instance is None:
            suffix_of(path)
        else:
            check_result_file(path, instance)


def check_picture(path: str | None) -> None:
    """Raise an `InputError` if a picture is to be drawn and its suffix is not one of a picture."""
    if path is not None:
        from alloc.allocators.plotting import check_plot

        check_plot(path)


def check_film(path: str | None) -> None:
    """Raise an `InputError` if an animation is to be written and its suffix is wrong or a program for it is missing."""
    if path is not None:
        from alloc.allocators.plotting import check_animation

        check_animation(path)


def check_output(name: str | None) -> None:
    """Raise an `InputError` if the file cannot be written."""
    from alloc.problems import InputError
    from alloc.problems.formats import check_writable

    if name == "":
        raise InputError("is not a file name", source="''")
    if name is not None:
        check_writable(name)
