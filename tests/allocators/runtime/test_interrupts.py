"""Stop requests: signals, and solvers on another thread."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from alloc.allocators.runtime.interrupts import abandoned_threads, run_native, signals_set


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_set_the_event(number: signal.Signals) -> None:
    """The first signal only sets the event; afterwards all handlers are restored."""
    before, stop = signal.getsignal(number), threading.Event()
    with signals_set(stop):
        os.kill(os.getpid(), number)
        assert stop.wait(5)
    assert signal.getsignal(number) is before


def test_second_interrupt_is_not_caught() -> None:
    """A second signal interrupts at once."""

    def insist() -> None:
        stop = threading.Event()
        with signals_set(stop):
            os.kill(os.getpid(), signal.SIGINT)
            assert stop.wait(5)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)

    with pytest.raises(KeyboardInterrupt):
        insist()


def test_other_threads_install_no_signal_handlers() -> None:
    """Outside the main thread, where Python allows no handlers, none is installed."""
    seen = []

    def work() -> None:
        with signals_set(threading.Event()):
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [signal.getsignal(signal.SIGINT)]


def test_native_work_returns_or_raises() -> None:
    """Its result is returned and its exception raised in the caller."""
    assert run_native(lambda: 7, lambda: False, lambda: None) == 7

    def fail() -> None:
        raise KeyError("inside")

    with pytest.raises(KeyError, match="inside"):
        run_native(fail, lambda: False, lambda: None)


def test_native_work_is_halted() -> None:
    """At the time limit the solver is requested to stop, and its result is used."""
    halted = threading.Event()

    def work() -> str:
        assert halted.wait(10)
        return "best so far"

    assert run_native(work, lambda: True, halted.set) == "best so far"


def test_unresponsive_native_work_is_abandoned() -> None:
    """A solver that does not stop delays the run by only a fraction of a second."""
    release, begin = threading.Event(), time.monotonic()
    assert run_native(lambda: release.wait(10), lambda: True, lambda: None) is None
    assert time.monotonic() - begin < 2
    (thread,) = abandoned_threads()
    release.set()
    thread.join(5)
    assert not abandoned_threads()


def test_exception_in_a_handler_halts_native_work() -> None:
    """A KeyboardInterrupt in the calling thread leaves no solver running."""
    halted = threading.Event()

    def interrupted() -> bool:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_native(lambda: halted.wait(10), interrupted, halted.set)
    assert halted.is_set()
    assert not abandoned_threads()


PROGRAM = """
import time
from alloc.allocators.runtime.interrupts import run_native

def work():
    time.sleep(1.5)
    print("calls back", flush=True)

run_native(work, lambda: True, lambda: None)
print("over", flush=True)
"""


def test_process_exit_waits_for_abandoned_threads() -> None:
    """A solver that calls back into an interpreter that has ended would crash the embedding program."""
    ran = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=30)
    assert (ran.returncode, ran.stdout.split("\n"), ran.stderr) == (0, ["over", "calls back", ""], "")
