"""The log of a training run: a CSV file, and event files for TensorBoard."""

import csv
import io
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self

from alloc.problems import MissingPackageError
from alloc.problems.formats import write_text_atomically

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


class Writer(Protocol):
    """The methods of TensorBoard's `SummaryWriter` that are used."""

    def add_scalar(self, tag: str, scalar_value: float, global_step: int) -> object:
        """Add a value at a step."""

    def flush(self) -> object:
        """Write all events to disk."""

    def close(self) -> object:
        """Close the file."""


class TrainingLog:
    """The log of a training run, one line per generation.

    Parameters
    ----------
    kind : type of dataclass
        Type of a report; its fields, one of which is ``decisions``, are the columns.
    path : Path
        CSV file, which is overwritten with `history`.
    tensorboard : Path or None
        Folder for event files, whose steps are decisions of agents.
    history : sequence of `kind`
        Previous generations.

    Raises
    ------
    InputError
        If TensorBoard is required but not installed, or a file cannot be written.
    """

    def __init__(
        self,
        kind: "type[DataclassInstance]",
        path: Path,
        tensorboard: Path | None,
        history: "Sequence[DataclassInstance]",
    ) -> None:
        self._path = path
        self._columns = [field.name for field in fields(kind)]
        text = io.StringIO(newline="")
        writer = csv.writer(text)
        writer.writerow(self._columns)
        writer.writerows(asdict(report).values() for report in history)
        self._events = None if tensorboard is None else _event_writer(tensorboard, history)
        write_text_atomically(path, text.getvalue())

    def append(self, report: "DataclassInstance") -> None:
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


def summary_writer() -> Callable[..., Writer]:
    """Return TensorBoard's `SummaryWriter`.

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
    writer: Callable[..., Writer] = SummaryWriter
    return writer


def _event_writer(folder: Path, history: "Sequence[DataclassInstance]") -> Writer:
    """Return a writer that purges the events that an interrupted run wrote after the end of `history`."""
    following = asdict(history[-1])["decisions"] + 1 if history else 0
    return summary_writer()(str(folder), purge_step=following)
