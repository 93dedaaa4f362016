"""Logs of missions as JSON lines (alloc-mission-log/1)."""

import json
from dataclasses import dataclass
from json import JSONDecodeError

from alloc.problems.errors import InputError
from alloc.problems.formats.columns import require_format
from alloc.problems.formats.files import PathLike, named, read_text, write_text_atomically
from alloc.problems.formats.json_columns import require_known
from alloc.problems.formats.json_text import encode, require_object
from alloc.problems.formats.messages import told

LOG_FORMAT = "alloc-mission-log/1"
HEADER_FIELDS = ("format", "mission", "policy", "knowledge", "seed", "version")

Record = dict[str, object]


@dataclass(frozen=True)
class MissionLog:
    """A log of a mission: header, records of what happened, and result.

    Attributes
    ----------
    header : dict
        Format, mission, policy, knowledge, seed and version.
    records : tuple of dict
        In chronological order; see `simulation.log.Log`.
    result : dict
        As in ``alloc-mission-result/1``.
    """

    header: Record
    records: tuple[Record, ...]
    result: Record

    def to_text(self) -> str:
        """Return the log as JSON lines: the header, the records, the result."""
        return "".join(f"{encode(line)}\n" for line in (self.header, *self.records, self.result))


def write_log(log: MissionLog, path: PathLike) -> None:
    """Write a log; ``-`` is standard output.

    Parameters
    ----------
    log : MissionLog
    path : str or path

    Raises
    ------
    InputError
        If it cannot be written.
    """
    write_text_atomically(path, log.to_text())


def read_log(path: PathLike) -> MissionLog:
    """Read a log; ``-`` is standard input.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    MissionLog

    Raises
    ------
    InputError
        If it cannot be read, or is not a log.
    """
    source = named(path)
    try:
        return log_from_text(read_text(path))
    except InputError as error:
        raise told(error, source) from error.__cause__


def is_log(text: str) -> bool:
    """Whether the first line of a text is the header of a log.

    Parameters
    ----------
    text : str
    """
    try:
        header = json.loads(text.partition("\n")[0])
    except (ValueError, RecursionError):
        return False
    return isinstance(header, dict) and str(header.get("format")).startswith("alloc-mission-log/")


def log_from_text(text: str) -> MissionLog:
    """Return the log in a text of JSON lines.

    Parameters
    ----------
    text : str

    Raises
    ------
    InputError
        If it is not a log.
    """
    _refuse_document(text)
    documents = [_line(line, number) for number, line in enumerate(text.split("\n"), 1) if line.strip()]
    if len(documents) < 2:
        raise InputError("is not a log of a mission: it needs a header, and a result as its last line; is it cut off?")
    header, *records, result = documents
    try:
        require_format(header.get("format"), (LOG_FORMAT,))
        require_known(header, HEADER_FIELDS, "")
        for name in HEADER_FIELDS:
            if name not in header:
                raise InputError("is missing", name)
    except InputError as error:
        raise InputError(error.message, ": ".join(part for part in ("line 1", error.place) if part)) from error
    if not str(result.get("format")).startswith("alloc-mission-result/"):
        raise InputError("must be the result of the mission; is the log cut off?", f"line {len(documents)}")
    return MissionLog(header, tuple(records), result)


def _refuse_document(text: str) -> None:
    """Raise an error for a text that is a single JSON object, e.g. a mission, whose first line alone is not JSON."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return
    if isinstance(found, dict) and found.get("format") != LOG_FORMAT:
        kind = f", but of the format {found['format']!r}" if "format" in found else ""
        raise InputError(f"is not a log of a mission{kind}; `alloc simulate --log` writes logs")


def _line(text: str, number: int) -> Record:
    try:
        return require_object(json.loads(text), f"line {number}")
    except JSONDecodeError as error:
        raise InputError(f"is not JSON: {error.msg[0].lower()}{error.msg[1:]}", f"line {number}") from error
    except RecursionError as error:
        raise InputError("is nested too deeply", f"line {number}") from error
