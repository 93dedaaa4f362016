"""The entry of `alloc`: Ctrl-C gives one line while modules are loaded, and is not lost while loops are compiled."""

import _thread
import sys
import threading

REPEATED_S = 0.05
"""Seconds after which a Ctrl-C that was lost is repeated."""


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
    """Raise `KeyboardInterrupt` again, a little later, where it was raised in Python code that native code had called.

    An exception cannot leave such code: Python reports it and goes on. A compiler calls Python when it has compiled a
    loop, which in first runs takes most of the time, so that most Ctrl-C would have no effect then.
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
