import io
import sys
import time

import pytest

from alloc.allocators import Improvement
from alloc.cli.output import progress
from alloc.cli.output.progress import CLEAR, Progress, progress_line
from alloc.problems import Allocation, evaluate


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def improvement(instance, tasks, bound=1.0):
    allocation = Allocation(tasks)
    return Improvement(0.0, allocation, evaluate(instance, allocation), bound)


def test_line_shows_seconds_makespan_gap_and_energy(small):
    """The line shows what is known: nothing yet, unserved tasks, or T with gap and energy."""
    assert progress_line(2.0, None).startswith("   2.0 s  no allocation yet; ")
    assert "  1 task unserved" in progress_line(2.0, improvement(small, [0, 1, -1, -1, -1]))
    assert "2 tasks unserved" in progress_line(2.0, improvement(small, [0, -1, -1, -1, -1]))
    assert "T 1.625  gap 38.5 %  energy 6" in progress_line(2.0, improvement(small, [0, 0, 0, 1, 2]))


def test_shown_on_terminals_and_cleared(small, monkeypatch):
    """On a terminal the line appears after a while, and is cleared at the end."""
    monkeypatch.setattr(progress, "FIRST_AFTER_S", 0.01)
    monkeypatch.setattr(progress, "EVERY_S", 0.01)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with Progress() as shown:
        shown.update(improvement(small, [0, 0, 0, 1, 2]))
        time.sleep(0.2)
    text = sys.stderr.getvalue()  # type: ignore[attr-defined]
    assert "T 1.625 " in text
    assert text.endswith(CLEAR)


@pytest.mark.parametrize(("terminal", "shown"), [("dumb", False), ("unknown", False), ("xterm", True)])
def test_terminals_that_cannot_clear_a_line_get_no_escape_codes(monkeypatch, terminal, shown):
    """Dumb terminals get no escape codes."""
    monkeypatch.setenv("TERM", terminal)
    monkeypatch.setattr(progress, "FIRST_AFTER_S", 0.0)
    monkeypatch.setattr(sys, "stderr", Terminal())
    with Progress():
        time.sleep(0.05)
    assert ("\x1b" in sys.stderr.getvalue()) == shown  # type: ignore[attr-defined]


def test_no_progress_for_short_runs_and_files(monkeypatch):
    """Nothing is shown for short runs, or if standard error is a file."""
    monkeypatch.setattr(sys, "stderr", Terminal())
    with Progress():
        pass
    assert sys.stderr.getvalue() == ""  # type: ignore[attr-defined]
    monkeypatch.setattr(progress, "FIRST_AFTER_S", 0.0)
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with Progress():
        time.sleep(0.05)
    assert sys.stderr.getvalue() == ""  # type: ignore[attr-defined]
