"""Service that solves requests in threads, with methods loaded once, a bounded queue, deadlines and cancellation."""

import json
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from enum import StrEnum
from weakref import WeakValueDictionary

from alloc.allocators.bounds import bounds_s
from alloc.allocators.contract.base import Allocator
from alloc.allocators.parallel.processors import available_threads
from alloc.allocators.registry import load
from alloc.allocators.result import Result
from alloc.allocators.runtime.interrupts import Cancellation, RunCancelledError
from alloc.allocators.serving.request import ANSWER_FORMAT, ServiceLimits, SolveRequest, identity
from alloc.allocators.solve import solve
from alloc.problems import InputError, RefusedError
from alloc.problems.formats.json_columns import Row
from alloc.problems.formats.json_text import parse, require_object
from alloc.problems.formats.messages import message_line

LOG = logging.getLogger("alloc.serve")

MAX_METHODS = 16
"""Maximum number of methods with parameters from requests that stay loaded; the least recently used is dropped."""


class Outcome(StrEnum):
    """Outcome of a request."""

    SOLVED = "solved"
    INPUT = "input"
    REFUSED = "refused"
    BUSY = "busy"
    CANCELLED = "cancelled"
    FAILED = "failed"


@dataclass(frozen=True)
class Answer:
    """The answer to a request: its outcome, and the document."""

    outcome: Outcome
    document: Row

    @property
    def text(self) -> str:
        """The document as JSON, in one line."""
        return json.dumps(self.document, allow_nan=False, separators=(",", ":"))


@dataclass(eq=False)
class Job:
    """A request in progress.

    Attributes
    ----------
    given : str or dict
        The document, as JSON text or parsed.
    cancellation : Cancellation
    arrived : float
        Time of arrival on the monotonic clock.
    ahead : int
        Number of requests that were running or waiting at that time.
    answer : Future of Answer
    """

    given: str | Row
    cancellation: Cancellation
    arrived: float = field(default_factory=time.monotonic)
    ahead: int = 0
    answer: "Future[Answer]" = field(default_factory=Future)

    def __post_init__(self) -> None:
        self.answer.set_running_or_notify_cancel()  # it can only be cancelled by `cancel`

    def cancel(self) -> None:
        """End the run at once; the answer says that it was cancelled."""
        self.cancellation.set()


class Service:
    """Accepts requests and answers each of them.

    Parameters
    ----------
    limits : ServiceLimits
    methods : mapping, optional
        Methods to load at once, with their default parameters for requests that set none.

    Raises
    ------
    InputError
        If one of the methods cannot be loaded.
    """

    def __init__(self, limits: ServiceLimits, methods: Mapping[str, Mapping[str, object]] | None = None) -> None:
        self.limits = limits
        self._own = {name: load(name, **settings) for name, settings in (methods or {}).items()}
        self._others: OrderedDict[str, Allocator] = OrderedDict()
        self._looking = threading.Lock()
        self._loading: WeakValueDictionary[str, threading.Lock] = WeakValueDictionary()
        self._threads = max(1, available_threads() // limits.parallel)
        self._ending = threading.Event()
        self._counting = threading.Lock()
        self._open = 0
        self._pool = ThreadPoolExecutor(limits.parallel, thread_name_prefix="alloc-serve")

    @property
    def open_requests(self) -> int:
        """Number of running and waiting requests."""
        return self._open

    @property
    def is_ending(self) -> bool:
        """Whether `end` was called."""
        return self._ending.is_set()

    def submit(self, given: str | Row, then: Callable[[Answer], None] = lambda answer: None) -> Job:
        """Accept a request, or reject it if the queue is full.

        Parameters
        ----------
        given : str or dict
            A document in the format ``alloc-solve-request/1``, as JSON text or parsed.
        then : callable
            Called with the answer, in the thread that produced it.

        Returns
        -------
        Job
        """
        job = Job(given, Cancellation(self._ending))
        job.answer.add_done_callback(lambda future: then(future.result()))
        with self._counting:
            is_full = self._open >= self.limits.parallel + self.limits.queue or self.is_ending
            job.ahead = self._open
            self._open += not is_full
        if is_full:
            words = "is ending" if self.is_ending else f"is busy: {self._open} requests are open; try again later"
            job.answer.set_result(failure(given, Outcome.BUSY, f"the service {words}"))
        else:
            self._pool.submit(self._answer, job)
        return job

    def end(self) -> None:
        """End all runs as their time limits do, and reject further requests."""
        self._ending.set()

    def close(self) -> None:
        """Wait until all requests are answered, and end the threads."""
        self._pool.shutdown()

    def _answer(self, job: Job) -> None:
        answer = failure(job.given, Outcome.FAILED, "defect in alloc or a plugin")
        try:
            answer = self._answered(job)
        finally:
            with self._counting:
                self._open -= 1
            job.answer.set_result(answer)

    def _answered(self, job: Job) -> Answer:
        """Return the answer, also for failures."""
        given = job.given
        try:
            if job.cancellation.is_cancelled:
                raise RunCancelledError("the run was cancelled")
            waited_s = time.monotonic() - job.arrived
            given = require_object(parse(given)) if isinstance(given, str) else given
            result = self._solve(SolveRequest.of(given, self.limits), job)
            document = result.to_dict()
            if job.cancellation.is_cancelled:
                raise RunCancelledError("the run was cancelled")
        except RunCancelledError as error:
            return failure(given, Outcome.CANCELLED, str(error))
        except InputError as error:
            return failure(given, Outcome.INPUT, str(error))
        except RefusedError as error:
            return failure(given, Outcome.REFUSED, str(error))
        except MemoryError:
            return failure(given, Outcome.FAILED, "there is not enough memory for this")
        except BaseException as error:  # including SystemExit from a plugin, which must not end this thread
            LOG.exception("a request failed")
            return failure(given, Outcome.FAILED, f"defect in alloc or a plugin: {type(error).__name__}: {error}")
        notes = {"notes": list(result.notes)} if result.notes else {}
        queue = {"ahead": job.ahead, "waited_ms": 1000 * waited_s}
        return Answer(Outcome.SOLVED, {**_head(given), **queue, "result": document, **notes})

    def _solve(self, request: SolveRequest, job: Job) -> Result:
        """Run the method for the time left since the request arrived."""
        arguments = dict(request.arguments)
        asked = arguments.pop("threads", None)
        threads = self._threads if asked is None else min(int(str(asked)), self._threads)
        method = self._method(request)
        left_s = max(0.0, request.limit_s - (time.monotonic() - job.arrived))
        return solve(
            request.instance,
            method,
            time_limit_s=left_s - bounds_s(left_s),  # bounds are computed after the run
            threads=max(1, threads),
            stop=job.cancellation,
            handle_signals=False,
            **arguments,  # type: ignore[arg-type]
        )

    def _method(self, request: SolveRequest) -> Allocator | str:
        """Return the method, loaded on first use."""
        name, parameters = request.method, request.parameters
        if name == "auto":
            if parameters:
                raise InputError("can only be set for a named method", "parameters")
            return name
        if not parameters and name in self._own:
            return self._own[name]
        key = f"{name} {sorted(parameters.items())}"
        with self._looking:
            loading = self._loading.setdefault(key, threading.Lock())
        with loading:  # a lock per method, as loading takes seconds and must not block other methods
            method = self._others.get(key)
            if method is None:
                method = load(name, parameters)
            with self._looking:
                self._others[key] = method
                self._others.move_to_end(key)
                if len(self._others) > MAX_METHODS:
                    self._others.popitem(last=False)
        return method


def failure(given: str | Row, outcome: Outcome, message: str) -> Answer:
    """Return the answer to a request without a result."""
    return Answer(outcome, {**_head(given), "error": {"kind": str(outcome), "message": message_line(message)}})


def _head(given: str | Row) -> Row:
    """Return the fields common to all answers, with the id of the request if it has a valid one."""
    try:
        known = identity(given.get("id"), "id") if isinstance(given, dict) else None
    except InputError:
        known = None
    return {"format": ANSWER_FORMAT, "id": known}
