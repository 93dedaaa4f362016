"""Stop requests: by signals, by the end of the process, and to native solvers, which only another thread can stop."""

import atexit
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

from alloc.problems import AllocError

Answer = TypeVar("Answer")

POLL_S = 0.01
GRACE_S = 0.3
"""How long a native solver may take to stop before its thread is abandoned."""

EXIT_GRACE_S = 10.0
"""How long the exit of the process waits for running threads: native code that calls Python after it would crash."""

THREAD_NAME = "alloc-native-solver"

_running: dict[object, tuple[threading.Thread, Callable[[], object]]] = {}
"""Blocks of `ended_with_process` in any thread, with what stops each."""

_ending = threading.Event()
"""Set once the exit of the process has begun."""


class Cancellation(threading.Event):
    """A stop request by a caller who will not take the answer, so that nothing is done once the method has stopped.

    Parameters
    ----------
    stop : threading.Event, optional
        One that ends the run with an answer: it counts as set here, too.
    """

    def __init__(self, stop: threading.Event | None = None) -> None:
        super().__init__()
        self._stop = stop

    @property
    def is_cancelled(self) -> bool:
        """Whether it was set itself."""
        return super().is_set()

    def is_set(self) -> bool:
        """Return whether the run is to end, with an answer or without."""
        return super().is_set() or (self._stop is not None and self._stop.is_set())


class RunCancelledError(AllocError):
    """A run was cancelled, and has no answer."""


def require_wanted(stop: threading.Event) -> None:
    """Raise an error where the answer is not wanted any more.

    Raises
    ------
    RunCancelledError
        If `stop` is a `Cancellation` that was set itself.
    """
    if isinstance(stop, Cancellation) and stop.is_cancelled:
        raise RunCancelledError("the run was cancelled")


@contextmanager
def signals_set(stop: threading.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set `stop` while the block runs; does nothing outside the main thread.

    A second signal has its previous effect, so that a run that hangs can still be ended. Handlers that an embedding
    program has set in C stay in place, as they could not be restored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    before = {number: handler for number, handler in handlers.items() if handler is not None}

    def request_stop(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    for number in before:
        signal.signal(number, request_stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_native(work: Callable[[], Answer], should_stop: Callable[[], bool], halt: Callable[[], None]) -> Answer | None:
    """Run `work` on another thread, and call `halt` once `should_stop` returns true.

    Parameters
    ----------
    work : callable
        Calls the solver; its exceptions are raised here.
    should_stop : callable
        Called every 10 ms in the calling thread, where signal handlers run. The exit of the process counts as well.
    halt : callable
        Requests the solver to stop; called at most once.

    Returns
    -------
    object or None
        The result of `work`; None if it did not stop within 0.3 s of `halt`. Its thread is then abandoned, and the exit
        of the process waits for it, up to 10 s.
    """
    answers: list[Answer] = []
    errors: list[BaseException] = []

    def target() -> None:
        try:
            answers.append(work())
        except BaseException as error:
            errors.append(error)

    thread, ended = threading.Thread(target=target, daemon=True, name=THREAD_NAME), threading.Event()
    with ended_with_process(ended.set):
        thread.start()
        try:
            while thread.is_alive() and not (ended.is_set() or should_stop()):
                thread.join(POLL_S)
        finally:  # an exception of a signal handler must not leave a solver running either
            if thread.is_alive():
                halt()
                thread.join(GRACE_S)
    if errors:
        raise errors[0]
    return answers[0] if answers else None


@contextmanager
def ended_with_process(end: Callable[[], object]) -> Iterator[None]:
    """Let the exit of the process call `end` while the block runs, and wait for the block, up to 10 s.

    A thread in native code while the interpreter is finalised may crash the process. Hence a thread that comes here
    only after the exit has begun sleeps instead, unless it is in such a block already.
    """
    thread, key = threading.current_thread(), object()
    inside = any(thread is other for other, _ in list(_running.values()))
    _running[key] = thread, end
    try:
        if not _ending.is_set():
            atexit.unregister(_end_all)
            atexit.register(_end_all)  # handlers run in reverse order: this one first
        elif not inside and thread is not threading.main_thread():
            del _running[key]
            time.sleep(EXIT_GRACE_S)
        yield
    finally:
        _running.pop(key, None)


def left_behind() -> list[threading.Thread]:
    """Return the abandoned threads of solvers that did not stop in time, and still run."""
    return [thread for thread in threading.enumerate() if thread.name == THREAD_NAME]


def _end_all() -> None:
    """Stop all blocks in any thread, and wait for them and for abandoned threads."""
    _ending.set()
    limit = time.monotonic() + EXIT_GRACE_S
    while _running and time.monotonic() < limit:
        for _, end in list(_running.values()):
            end()
        time.sleep(POLL_S)
    for thread in left_behind():
        thread.join(max(0.0, limit - time.monotonic()))


def _forget() -> None:
    """Reset in a forked process, where no other thread runs."""
    _running.clear()
    _ending.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
