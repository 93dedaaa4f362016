"""Stopping a run from outside: signals, the end of the process, and solvers that only a second thread can stop."""

import atexit
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

Answer = TypeVar("Answer")

POLL_S = 0.02
GRACE_S = 0.3
"""How long a native solver may take to obey before its thread is left behind."""

EXIT_GRACE_S = 10.0
"""How long the end of the process waits for what still runs: native code that then calls back into Python, crashes."""

THREAD_NAME = "alloc-native-solver"

_running: dict[object, tuple[threading.Thread, Callable[[], object]]] = {}
"""What is going on in any thread, and how to end it."""

_ending = threading.Event()
"""Set once the process ends."""


@contextmanager
def signals_set(stop: threading.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM set `stop` while the block runs; does nothing outside the main thread.

    A second signal does what it did before, so that a run that hangs can still be ended. A handler that a program
    which embeds this has set in C stays in place, as it could not be put back.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    before = {number: handler for number, handler in handlers.items() if handler is not None}

    def ask_to_stop(number: int, frame: FrameType | None) -> None:
        stop.set()
        signal.signal(number, before[signal.Signals(number)])

    for number in before:
        signal.signal(number, ask_to_stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def run_native(work: Callable[[], Answer], should_stop: Callable[[], bool], halt: Callable[[], None]) -> Answer | None:
    """Run `work` on another thread, and call `halt` once `should_stop` says so.

    Parameters
    ----------
    work : callable
        Calls the solver; its exceptions are raised here.
    should_stop : callable
        Asked every 20 ms in the calling thread, where signal handlers run. The end of the process counts as well.
    halt : callable
        Asks the solver to end; called once at the most.

    Returns
    -------
    object or None
        The answer of `work`; None if it did not obey within 0.3 s of `halt`, its thread then being left behind. The
        end of the process waits for it, for 10 s at most.
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
        finally:  # what a signal handler raises must not leave a solver at work either
            if thread.is_alive():
                halt()
                thread.join(GRACE_S)
    if errors:
        raise errors[0]
    return answers[0] if answers else None


@contextmanager
def ended_with_process(end: Callable[[], object]) -> Iterator[None]:
    """Have the end of the process call `end`, and wait until the block is left, for 10 s at most.

    A thread that dies with the interpreter while it is in native code may crash the process: so one that gets here
    only after that end has begun, waits for its death instead, unless it is in such a block already.
    """
    thread, key = threading.current_thread(), object()
    inside = any(thread is other for other, _ in list(_running.values()))
    _running[key] = thread, end
    try:
        if not _ending.is_set():
            atexit.unregister(_end_all)
            atexit.register(_end_all)  # comes first of all that is registered by now
        elif not inside and thread is not threading.main_thread():
            del _running[key]
            time.sleep(EXIT_GRACE_S)
        yield
    finally:
        _running.pop(key, None)


def left_behind() -> list[threading.Thread]:
    """Return the threads of solvers that did not obey, and have not ended since."""
    return [thread for thread in threading.enumerate() if thread.name == THREAD_NAME]


def _end_all() -> None:
    """End what runs in any thread, and wait for it, for those left behind too."""
    _ending.set()
    limit = time.monotonic() + EXIT_GRACE_S
    while _running and time.monotonic() < limit:
        for _, end in list(_running.values()):
            end()
        time.sleep(POLL_S)
    for thread in left_behind():
        thread.join(max(0.0, limit - time.monotonic()))


def _forget() -> None:
    """In a process just forked, no other thread runs."""
    _running.clear()
    _ending.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
