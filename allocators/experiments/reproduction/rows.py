"""Rows of runs that have ended, in files of comma-separated values to which whole runs are appended."""

import csv
import errno
import io
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TypeVar

from alloc.problems import InputError


@dataclass(frozen=True)
class Learned:
    """A policy in training, judged by greedy games on one instance, or on the test games.

    Attributes
    ----------
    method : str
    run, iterations, iteration, scenario : int
        Which run of how many iterations, after which of them, and on the instance of which scenario; 0 for the medians
        over the test games, or means where that is said.
    decisions, evaluations : int
        Decisions of agents and states evaluated by networks, by all members together.
    makespan, lower_bound : float
        In hours, at the best position of the game, and the proven bound.
    unserved : float
        Tasks without an agent at the end of the game; a mean.
    battery : float
        Percentage left at the end of the episode, where every hop is flown; a mean.
    hops, distance : float
        Moves per agent in the episode, and direct flight per agent at the best position; means.
    drawn : float
        Best makespan of several drawn games, the mean over the test games; only at the end of a run, else nan.
    seconds : float
        Processor time of the training.
    """

    method: str
    run: int
    iterations: int
    iteration: int
    scenario: int
    decisions: int
    evaluations: int
    makespan: float
    lower_bound: float
    unserved: float
    battery: float
    hops: float
    distance: float
    drawn: float
    seconds: float


@dataclass(frozen=True)
class Solved:
    """What a method that learns nothing made of a run's instance of a scenario.

    Attributes
    ----------
    method, status : str
    run, scenario : int
    time_limit_s : float
    makespan, lower_bound : float
        In hours.
    unserved : int
    battery : float
        Percentage left where agents fly to their task directly.
    seconds : float
    """

    method: str
    run: int
    scenario: int
    time_limit_s: float
    status: str
    makespan: float
    lower_bound: float
    unserved: int
    battery: float
    seconds: float


Row = TypeVar("Row", Learned, Solved)


def append(path: Path, rows: Sequence[Learned] | Sequence[Solved]) -> None:
    """Append the rows of a run in one piece, so that several processes may do so, and none is torn by another.

    A line that a crash has torn is first ended by more commas than any row has, so that it is not read as a row.

    Raises
    ------
    OSError
        If not all of them could be written.
    """
    text = io.StringIO()
    names = [field.name for field in fields(rows[0])]
    table = csv.DictWriter(text, names, lineterminator="\n")
    for row in rows:
        table.writerow({name: f"{v:.6g}" if isinstance(v, float) else v for name, v in asdict(row).items()})
    handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        size = os.fstat(handle).st_size
        is_torn = size > 0 and os.pread(handle, 1, size - 1) != b"\n"
        data = ("," * len(names) + "\n" if is_torn else "").encode() + text.getvalue().encode()
        if os.write(handle, data) < len(data):
            raise OSError(errno.ENOSPC, "only a part of the rows of a run could be written", str(path))
        os.fsync(handle)
    finally:
        os.close(handle)


def begin(path: Path, kind: type[Learned] | type[Solved]) -> None:
    """Write the header of a file that does not exist."""
    if not path.exists():
        path.write_text(",".join(field.name for field in fields(kind)) + "\n", encoding="utf-8")


def read(path: Path, kind: type[Row]) -> list[Row]:
    """Return all rows of a file, none where there is no such file; a line that a crash has torn is left out.

    Raises
    ------
    InputError
        If the file has other columns.
    """
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    whole, _, _ = text.rpartition("\n")
    lines = csv.reader(whole.splitlines())
    names = [field.name for field in fields(kind)]
    if next(lines, None) != names:
        raise InputError(f"must have the columns {', '.join(names)}", source=str(path))
    kinds = [field.type for field in fields(kind)]
    return [
        kind(*(form(cell) for form, cell in zip(kinds, line, strict=True)))  # type: ignore[operator]
        for line in lines
        if len(line) == len(names)
    ]
