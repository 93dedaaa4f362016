"""The progress line of a long run: seconds, best makespan, gap and energy."""

import os
import shutil
import sys
import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING

from alloc.cli.output.console import flush, is_terminal
from alloc.problems.text import counted, labelled, number, percent

if TYPE_CHECKING:
    from alloc.allocators import Improvement

FIRST_AFTER_S = 1.0
EVERY_S = 0.2
CLEAR = "\r\x1b[K"


class Progress:
    """Shows a progress line on standard error after the first second, and clears it at the end.

    Parameters
    ----------
    wanted : bool
        If False, nothing is shown; nor if standard error is not a terminal or cannot clear a line (``TERM=dumb``).
    time_unit, energy_unit : str
        Labels of the units.
    """

    def __init__(self, wanted: bool = True, time_unit: str = "", energy_unit: str = "") -> None:
        self._units = time_unit, energy_unit
        self._wanted = wanted and is_terminal(sys.stderr) and os.environ.get("TERM") not in ("dumb", "unknown")
        self._best: Improvement | None = None
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._show, daemon=True, name="alloc-progress")

    def __enter__(self) -> "Progress":
        self._begin = time.monotonic()
        if self._wanted:
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        if self._wanted:
            self._thread.join()

    def update(self, best: "Improvement") -> None:
        """Set the best allocation so far; a callback for `on_improvement`."""
        self._best = best

    def _show(self) -> None:
        if self._end.wait(FIRST_AFTER_S):
            return
        while True:
            width = shutil.get_terminal_size().columns - 1
            _put(CLEAR + progress_line(time.monotonic() - self._begin, self._best, *self._units)[:width])
            if self._end.wait(EVERY_S):
                break
        _put(CLEAR)


def progress_line(elapsed_s: float, best: "Improvement | None", time_unit: str = "", energy_unit: str = "") -> str:
    """Return the text of the progress line."""
    if best is None:
        return f"{elapsed_s:6.1f} s  no allocation yet; some methods compile code in their first run"
    score = best.evaluation
    energy = labelled(number(score.energy), energy_unit)
    if score.makespan is None:
        unserved = counted(len(score.unserved_tasks), "task")
        return f"{elapsed_s:6.1f} s  {unserved} unserved  energy {energy}"
    gap = max(0.0, 1 - best.lower_bound / score.makespan) if score.makespan else 0.0
    makespan = labelled(number(score.makespan), time_unit)
    return f"{elapsed_s:6.1f} s  T {makespan}  gap {percent(gap)}  energy {energy}"


def _put(text: str) -> None:
    try:
        sys.stderr.write(text)
        flush(sys.stderr)
    except (OSError, ValueError):
        return  # the terminal is closed; the run goes on
