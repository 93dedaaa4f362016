"""A service for one program in any language: each line of JSON is a request, each answer a line."""

import threading
from collections.abc import Callable

from alloc.allocators.serving.request import identity
from alloc.allocators.serving.service import Answer, Job, Outcome, Service, failure
from alloc.problems import InputError
from alloc.problems.formats.json_columns import Row
from alloc.problems.formats.json_text import parse, require_object


class RequestLines:
    """Takes lines, and writes the answers as they come, which need not be in the order of the lines.

    Parameters
    ----------
    service : Service
    write : callable
        Writes one line; never called by two threads at once.
    """

    def __init__(self, service: Service, write: Callable[[str], None]) -> None:
        self._service, self._write_line = service, write
        self._writing, self._listing = threading.Lock(), threading.Lock()
        self._open: dict[str | float, Job] = {}

    def take(self, line: str) -> None:
        """Begin what a line asks for."""
        if not line.strip():
            return
        try:
            row = require_object(parse(line))
        except InputError as error:
            self._write(failure(line, Outcome.INPUT, str(error)))
            return
        try:
            if "cancel" in row:
                self._cancel(row)
            else:
                self._begin(row)
        except InputError as error:
            self._write(failure(row, Outcome.INPUT, str(error)))

    def _begin(self, row: Row) -> None:
        key = identity(row.get("id"), "id")
        with self._listing:
            if key in self._open:
                raise InputError(f"{key!r} is that of another request that is not answered yet", "id")
        job = self._service.submit(row, lambda answer: self._end(key, answer))
        if not job.answer.done():
            with self._listing:
                self._open[key] = job
        if job.answer.done():  # in the meantime
            with self._listing:
                self._open.pop(key, None)

    def _end(self, key: str | float, answer: Answer) -> None:
        with self._listing:
            self._open.pop(key, None)
        self._write(answer)

    def _cancel(self, row: Row) -> None:
        """Cancel a request, whose answer says so; one that is unknown, or answered already, is an error."""
        key = identity(row["cancel"], "cancel")
        with self._listing:
            job = self._open.get(key)
        if job is None:
            raise InputError(f"there is no open request {key!r}; it may be answered already", "cancel")
        job.cancel()

    def _write(self, answer: Answer) -> None:
        with self._writing:
            self._write_line(answer.text)
