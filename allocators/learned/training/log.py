"""The log of a training run: a CSV file, and event files for TensorBoard."""

import csv
import io
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from alloc.problems import MissingPackageError
from alloc.problems.formats import write_text_atomically


class TrainingLog:
    """Writes one line per generation.

    Parameters
    ----------
    kind : dataclass
        Whose fields are the columns.
    path : Path
        CSV file; it is written anew with what is in `history`.
    tensorboard : Path or None
        Folder for event files, whose steps are decisions of agents.
    history : sequence of `kind`
        Generations that are behind.

    Raises
    ------
    InputError
        If TensorBoard is asked for and not installed, or a file cannot be written.
    """

    def __init__(self, kind: type[Any], path: Path, tensorboard: Path | None, history: Sequence[Any]) -> None:
        self._path = path
        self._columns = [field.name for field in fields(kind)]
        text = io.StringIO(newline="")
        writer = csv.writer(text)
        writer.writerow(self._columns)
        writer.writerows(asdict(report).values() for report in history)
        self._events = None if tensorboard is None else _event_writer(tensorboard, history)
        write_text_atomically(path, text.getvalue())

    def append(self, report: Any) -> None:
        """Add a generation."""
        values = asdict(report)
        with self._path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(values.values())
        if self._events is not None:
            for name in self._columns:
                self._events.add_scalar(f"training/{name}", values[name], values["decisions"])
            self._events.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._events is not None:
            self._events.close()


def summary_writer() -> Any:
    """Return TensorBoard's class of writers, one of which hides what is in its folder from its first step on.

    Raises
    ------
    InputError
        If TensorBoard is not installed.
    """
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError as error:
        message = "needs TensorBoard, which is not installed; pip install 'alloc-mrta[train]'"
        raise MissingPackageError(message, "tensorboard") from error
    return SummaryWriter


def _event_writer(folder: Path, history: Sequence[Any]) -> Any:
    """Return a writer that hides what an interrupted run wrote after the end of `history`."""
    following = history[-1].decisions + 1 if history else 0
    return summary_writer()(str(folder), purge_step=following)
