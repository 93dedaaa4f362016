"""Stop requests: by signals, at process exit, and to native solvers, which only another thread can stop."""

import atexit
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from alloc.problems import AllocError

Answer = TypeVar("Answer")
Handler = Callable[[int, FrameType | None], object]

ENDING = (signal.SIGINT, signal.SIGTERM)
"""Signals that ask a run to end."""

POLL_S = 0.01
GRACE_S = 0.3
"""Seconds that a native solver may take to stop before its thread is abandoned."""

EXIT_GRACE_S = 10.0
"""Seconds that process exit waits for running threads: native code that calls Python afterwards would crash."""

THREAD_NAME = "alloc-native-solver"

_running: dict[object, tuple[threading.Thread, Callable[[], object]]] = {}
"""The running blocks of `stopped_at_exit` in all threads, each with the function that stops it."""

_ending = threading.Event()
"""Set when process exit begins."""


class Cancellation(threading.Event):
    """A stop request by a caller who does not need the answer, so that the run ends right after the method stops.

    Parameters
    ----------
    stop : threading.Event, optional
        An ordinary stop request, which ends the run with an answer; while it is set, this event also counts as set.
    """

    def __init__(self, stop: threading.Event | None = None) -> None:
        super().__init__()
        self._stop = stop

    @property
    def is_cancelled(self) -> bool:
        """Whether this event itself was set."""
        return super().is_set()

    def is_set(self) -> bool:
        """Return whether the run should end, with or without an answer."""
        return super().is_set() or (self._stop is not None and self._stop.is_set())


class RunCancelledError(AllocError):
    """A run was cancelled and has no answer."""


def raise_if_cancelled(stop: threading.Event) -> None:
    """Raise an error if the answer is no longer wanted.

    Raises
    ------
    RunCancelledError
        If `stop` is a `Cancellation` that itself was set.
    """
    if isinstance(stop, Cancellation) and stop.is_cancelled:
        raise RunCancelledError("the run was cancelled")


@contextmanager
def signals_handled(numbers: Sequence[signal.Signals], handler: Handler) -> Iterator[None]:
    """Handle signals while the block runs; outside the main thread, do nothing.

    Handlers that an embedding program has set in C are kept, as they could not be restored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: known for number in numbers if (known := signal.getsignal(number)) is not None}
    for number in before:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number, known in before.items():
            signal.signal(number, known)


@contextmanager
def signals_set(stop: threading.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set `stop` while the block runs, as `signals_handled` does.

    A second signal has its previous effect, so that a hanging run can still be ended.
    """
    before = {number: signal.getsignal(number) for number in ENDING}

    def request_stop(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    with signals_handled(ENDING, request_stop):
        yield


@contextmanager
def sigterm_interrupts() -> Iterator[None]:
    """Let SIGTERM raise `KeyboardInterrupt`, as Ctrl-C does, while the block runs, as `signals_handled` does."""

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    with signals_handled((signal.SIGTERM,), interrupt):
        yield


def run_native(work: Callable[[], Answer], should_stop: Callable[[], bool], halt: Callable[[], None]) -> Answer | None:
    """Run `work` in another thread, and call `halt` when `should_stop` returns true.

    Parameters
    ----------
    work : callable
        Calls the solver; its exceptions are re-raised.
    should_stop : callable
        Called every 10 ms in the calling thread, where signal handlers run. Process exit also counts as a stop request.
    halt : callable
        Asks the solver to stop; called at most once.

    Returns
    -------
    object or None
        The result of `work`; None if it did not stop within 0.3 s after `halt`. Its thread is then abandoned, and
        process exit waits for it, up to 10 s.
    """
    answers: list[Answer] = []
    errors: list[BaseException] = []

    def target() -> None:
        try:
            answers.append(work())
        except BaseException as error:
            errors.append(error)

    thread, ended = threading.Thread(target=target, daemon=True, name=THREAD_NAME), threading.Event()
    with stopped_at_exit(ended.set):
        thread.start()
        try:
            while thread.is_alive() and not (ended.is_set() or should_stop()):
                thread.join(POLL_S)
        finally:  # do not leave a solver running after an exception from a signal handler
            if thread.is_alive():
                halt()
                thread.join(GRACE_S)
    if errors:
        raise errors[0]
    return answers[0] if answers else None


@contextmanager
def stopped_at_exit(end: Callable[[], object]) -> Iterator[None]:
    """Let process exit call `end` while the block runs, and wait for the block, up to 10 s.

    A thread that is in native code while the interpreter is finalised may crash the process. Hence a thread that enters
    a block after exit has begun sleeps instead, unless it is in such a block already.
    """
    thread, key = threading.current_thread(), object()
    inside = any(thread is other for other, _ in list(_running.values()))
    _running[key] = thread, end
    try:
        if not _ending.is_set():
            atexit.unregister(_stop_all)
            atexit.register(_stop_all)  # handlers run in reverse order: this one runs first
        elif not inside and thread is not threading.main_thread():
            del _running[key]
            time.sleep(EXIT_GRACE_S)
        yield
    finally:
        _running.pop(key, None)


def abandoned_threads() -> list[threading.Thread]:
    """Return the abandoned threads of solvers that did not stop in time and still run."""
    return [thread for thread in threading.enumerate() if thread.name == THREAD_NAME]


def _stop_all() -> None:
    """Stop the blocks in all threads, and wait for them and for abandoned threads."""
    _ending.set()
    limit = time.monotonic() + EXIT_GRACE_S
    while _running and time.monotonic() < limit:
        for _, end in list(_running.values()):
            end()
        time.sleep(POLL_S)
    for thread in abandoned_threads():
        thread.join(max(0.0, limit - time.monotonic()))


def _reset_after_fork() -> None:
    """Reset in a forked process, where no other thread runs."""
    _running.clear()
    _ending.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_reset_after_fork)
