"""Service over lines of JSON for one program in any language: a line per request and per answer."""

import threading
from collections.abc import Callable

from alloc.allocators.serving.request import identity
from alloc.allocators.serving.service import Answer, Job, Outcome, Service, failure
from alloc.problems import InputError
from alloc.problems.formats.json_columns import Row
from alloc.problems.formats.json_text import parse, require_object


class RequestLines:
    """Processes request lines, and writes answers as they are ready, not necessarily in order.

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
        """Start the request in a line."""
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
                raise InputError(f"{key!r} is used by another request that is not answered yet", "id")
        job = self._service.submit(row, lambda answer: self._end(key, answer))
        if not job.answer.done():
            with self._listing:
                self._open[key] = job
        if job.answer.done():  # answered in the meantime
            with self._listing:
                self._open.pop(key, None)

    def _end(self, key: str | float, answer: Answer) -> None:
        with self._listing:
            self._open.pop(key, None)
        self._write(answer)

    def _cancel(self, row: Row) -> None:
        """Cancel a request, whose answer says so; raise an error if it is unknown or already answered."""
        key = identity(row["cancel"], "cancel")
        with self._listing:
            job = self._open.get(key)
        if job is None:
            raise InputError(f"no open request {key!r}; it may have been answered already", "cancel")
        job.cancel()

    def _write(self, answer: Answer) -> None:
        with self._writing:
            self._write_line(answer.text)
