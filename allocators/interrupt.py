"""Stopping a run from outside: signals, and solvers in native code that only a second thread can stop."""

import atexit
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
"""How long the end of the process waits for those left behind: one that calls back into Python after it, crashes."""

THREAD_NAME = "alloc-native-solver"


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
        Asked every 20 ms in the calling thread, where signal handlers run.
    halt : callable
        Asks the solver to end; called once.

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

    thread = threading.Thread(target=target, daemon=True, name=THREAD_NAME)
    thread.start()
    while thread.is_alive() and not should_stop():
        thread.join(POLL_S)
    if thread.is_alive():
        halt()
        thread.join(GRACE_S)
    if thread.is_alive():
        atexit.unregister(_await_left_behind)
        atexit.register(_await_left_behind)
    if errors:
        raise errors[0]
    return answers[0] if answers else None


def left_behind() -> list[threading.Thread]:
    """Return the threads of solvers that did not obey, and have not ended since."""
    return [thread for thread in threading.enumerate() if thread.name == THREAD_NAME]


def _await_left_behind() -> None:
    end = time.monotonic() + EXIT_GRACE_S
    for thread in left_behind():
        thread.join(max(0.0, end - time.monotonic()))
