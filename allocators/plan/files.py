"""Result files: JSON, a table, a workbook, GeoJSON or a map, depending on the suffix."""

import json
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.geojson import to_geojson
from alloc.allocators.plan.map import MAX_AGENTS, to_html
from alloc.allocators.plan.spreadsheet import MAX_ROWS, to_csv, to_workbook
from alloc.problems import InputError, Instance, MissingPackageError
from alloc.problems.formats import write_bytes_atomically
from alloc.problems.formats.files import PathLike, is_stream, named
from alloc.problems.vocabulary import GEOGRAPHIC

if TYPE_CHECKING:
    from alloc.allocators.result import Result

JSON = ".json"


def to_json(result: "Result") -> str:
    """Return the JSON document of a result."""
    return json.dumps(result.to_dict(), indent=2, allow_nan=False) + "\n"


WRITERS: dict[str, Callable[["Result"], str | bytes]] = {
    JSON: to_json,
    ".csv": to_csv,
    ".xlsx": to_workbook,
    ".geojson": to_geojson,
    ".html": to_html,
}
"""Functions that return the content of a file, by suffix."""


def write_result(result: "Result", path: PathLike) -> None:
    """Write a result to a file atomically; the suffix of the file name determines the format.

    Parameters
    ----------
    result : Result
    path : str or path
        ``.json`` for the document that `read_result` reads; ``.csv`` for a row per agent; ``.xlsx`` for a workbook with
        the summary, the tasks and the agents, which needs openpyxl; ``.geojson`` for tasks, agents and moves, if
        positions are longitudes and latitudes; ``.html`` for a map that a browser opens from disk.

    Raises
    ------
    InputError
        If the suffix is another one, the positions are unknown or of another kind, or the file cannot be written.
    MissingPackageError
        If openpyxl is needed but not installed.
    """
    check_result_file(path, result.instance)
    write_bytes_atomically(path, content(result, suffix_of(path)))


def content(result: "Result", suffix: str) -> bytes:
    """Return the content of the file with this suffix."""
    text = WRITERS[suffix](result)
    return text.encode("utf-8", "replace") if isinstance(text, str) else text


def suffix_of(path: PathLike) -> str:
    """Return the suffix that determines the format: that of the name, or ``.json`` for streams and devices.

    Raises
    ------
    InputError
        If the suffix is unknown.
    """
    target = Path(path)
    if is_stream(path) or (target.exists() and not target.is_file() and not target.is_dir()):
        return JSON
    suffix = target.suffix.lower()
    if suffix not in WRITERS:
        *most, last = WRITERS
        raise InputError(f"must end in {', '.join(most)} or {last}, or be - for standard output", source=named(path))
    return suffix


def check_result_file(path: PathLike, instance: Instance) -> None:
    """Raise an error if results on this instance cannot be written to a file of this name.

    Raises
    ------
    InputError
        If the suffix is unknown, or the instance lacks the positions for it, or is too large.
    MissingPackageError
        If a required package is not installed.
    """
    suffix = suffix_of(path)
    problem = ""
    if suffix == ".xlsx":
        if find_spec("openpyxl") is None:
            raise MissingPackageError(f"{named(path)} needs openpyxl; install with: pip install 'alloc-mrta[tables]'")
        if max(instance.n, instance.m) >= MAX_ROWS:
            problem = f"a sheet holds at most {MAX_ROWS} rows, but there are more agents or tasks; write .csv"
    elif suffix == ".geojson" and instance.metric != GEOGRAPHIC:
        problem = f"needs the metric 'geographic', but the instance has {instance.metric!r}; write .html"
    elif suffix == ".html" and np.isnan(instance.task_position).all():
        problem = "needs positions, but no task of the instance has one; write .csv or .xlsx"
    elif suffix == ".html" and instance.n > MAX_AGENTS:
        problem = f"is for at most {MAX_AGENTS} agents, but there are {instance.n}; write .csv"
    if problem:
        raise InputError(problem, source=named(path))
