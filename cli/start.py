"""Entry point of `alloc`: handles Ctrl-C while modules are loaded and while code is compiled."""

import _thread
import sys
import threading

REPEATED_S = 0.05
"""Seconds after which a lost Ctrl-C is repeated."""


def start() -> int:
    """Run `alloc` with the arguments of the process, and return its exit code."""
    repeat_lost_interrupts()
    try:
        from alloc.cli.main import main
    except KeyboardInterrupt:
        from alloc.cli.output.console import interrupted

        return interrupted()
    return main()


def repeat_lost_interrupts() -> None:
    """Repeat a `KeyboardInterrupt` shortly after it was raised in Python code called by native code.

    Such code cannot propagate exceptions: Python only reports them. The compiler calls back into Python, and takes
    most of the time of a first run, so that most Ctrl-C would otherwise have no effect then.
    """
    report = sys.unraisablehook

    def repeat(unraisable: "sys.UnraisableHookArgs") -> None:
        if unraisable.exc_type is not KeyboardInterrupt:
            report(unraisable)
            return
        again = threading.Timer(REPEATED_S, _thread.interrupt_main)
        again.daemon = True
        again.start()

    sys.unraisablehook = repeat
