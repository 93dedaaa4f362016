"""Sets of instances on the command line: files, folders, patterns, tables of these, and generated families."""

import csv
import glob
import os
import re
from collections.abc import Collection, Sequence
from inspect import signature
from typing import TYPE_CHECKING, Any

from alloc.cli.options import BETWEEN_SETTINGS, values
from alloc.cli.output.files import read_instances

if TYPE_CHECKING:
    from alloc.problems import Instance, Mission

FAMILY = re.compile(r"(paper-[1-4]|random|covering)(?:\[(.*)\])?:(\d{1,9})(?:-(\d{1,9}))?")
"""Pattern of a generated family with a range of seeds, both ends included."""

MAX_GENERATED = 100_000

COLUMN = "instance"
"""Column of a table of instances that names them; other columns are ignored."""


def gather(sources: Sequence[str]) -> "list[Instance]":
    """Return the instances of all sources, in order.

    Raises
    ------
    InputError
        If a source cannot be read, a pattern matches nothing, or a family is invalid.
    """
    return [instance for source in sources for instance in _instances(source)]


def gather_missions(sources: Sequence[str]) -> "list[Mission]":
    """Return the missions of all sources, in order: files, patterns of them, and folders of .json files.

    Raises
    ------
    InputError
        If a source cannot be read, a pattern matches nothing, or a folder contains no missions.
    """
    from alloc.problems import read_mission

    return [read_mission(file) for source in sources for file in _mission_files(source)]


def _mission_files(source: str) -> list[str]:
    from alloc.problems import InputError

    if os.path.isdir(source) and not os.path.exists(os.path.join(source, "agents.csv")):
        found = sorted(glob.glob(os.path.join(glob.escape(source), "*.json")))
        if not found:
            raise InputError("contains no missions", source=source)
        return found
    return [source] if os.path.exists(source) or not glob.has_magic(source) else _matching(source)


def _matching(pattern: str) -> list[str]:
    """Return the files and folders that match a pattern, sorted by name."""
    from alloc.problems import InputError

    found = sorted(glob.glob(pattern, recursive=True))
    if not found:
        raise InputError("matches no file", source=pattern)
    return found


def _instances(source: str) -> "list[Instance]":
    if os.path.isfile(source) and source.endswith(".csv"):
        return gather(_listed(source))
    family = FAMILY.fullmatch(source)
    if os.path.exists(source) or source == "-":
        return read_instances(source)
    if family is not None:
        return _generated(source, *family.groups())
    if glob.has_magic(source):
        return gather(_matching(source))
    return read_instances(source)


def _listed(table: str) -> list[str]:
    """Return the sources in the rows of a table; relative paths start at its folder."""
    from alloc.problems import InputError
    from alloc.problems.formats.files import read_text

    rows = csv.DictReader(read_text(table).splitlines())
    if COLUMN not in (rows.fieldnames or ()):
        raise InputError(f"has no column {COLUMN!r} with files or families", source=table)
    names = [row[COLUMN].strip() for row in rows if (row[COLUMN] or "").strip()]
    folder = os.path.dirname(table)
    return [name if FAMILY.fullmatch(name) else os.path.join(folder, name) for name in names]


def _generated(source: str, family: str, settings: str | None, first: str, last: str | None) -> "list[Instance]":
    from alloc.problems import Family, InputError, paper, random_instance

    seeds = range(int(first), int(last or first) + 1)
    if not 0 < len(seeds) <= MAX_GENERATED:
        raise InputError(f"must be an ascending range of at most {MAX_GENERATED} seeds", source=source)
    try:
        given: dict[str, Any] = values(BETWEEN_SETTINGS.split(settings) if settings else [])
        if family == "covering":
            _check_known(given, signature(covering).parameters, family)
            return [covering(seed, **given) for seed in seeds]
        if family != "random":
            if settings is not None:
                raise InputError("takes no parameters; only random and covering do", family)
            return [paper(int(family.removeprefix("paper-")), seed) for seed in seeds]
        _check_known(given, Family.__dataclass_fields__, family)
        title = source.rpartition(":")[0]
        return [random_instance(Family(**given), seed, name=f"{title}:{seed}") for seed in seeds]
    except InputError as error:
        raise InputError(error.message, error.place, source) from error


def _check_known(given: Collection[str], known: Collection[str], family: str) -> None:
    """Raise an error for a parameter that a family does not have; seeds follow the colon."""
    from alloc.problems import InputError

    unknown = sorted(set(given) - (set(known) - {"seed"}))
    if unknown:
        raise InputError(f"is not a parameter of a {family} family", unknown[0])


def covering(
    seed: int,
    agents: int = 100,
    tasks: int = 25,
    ability_min: float = 1,
    ability_max: float = 1000,
    workload: str = "equal",
    integer: bool = True,
    choices: int | None = None,
) -> "Instance":
    """Return an instance of machine covering with the parameters of ``alloc generate covering``.

    Raises
    ------
    InputError
        If abilities are not whole numbers, or workloads are neither equal nor uniform.
    """
    from alloc.problems import InputError, machine_covering
    from alloc.problems.arguments import real

    if workload not in ("equal", "uniform"):
        raise InputError("must be equal or uniform here", "workload")
    for name, value in (("ability_min", ability_min), ("ability_max", ability_max)):
        if real(value, name) != int(value):
            raise InputError(f"must be a whole number here, got {value}", name)
    equal, ends = workload == "equal", (int(ability_min), int(ability_max))
    return machine_covering(agents, tasks, *ends, seed, equal=equal, whole=integer, choices=choices)
