import ctypes
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from alloc.cli.start import repeat_lost_interrupts
from alloc.problems import Family, random_instance
from alloc.problems.formats import write_instance

INTERRUPTED = "alloc: interrupted before it was done\n"

PATIENCE_S = 2.5
"""A second for the run to end, and as much again, and some, for a busy machine to end the process."""

LAUNCHER = """
import contextlib, importlib, sys
from alloc.allocators import Allocator, Method, Proposal, registry
from alloc.allocators.heuristic.greedy.list_schedule import greedy

class Slow(Allocator):
    method = Method(name="slow", summary="greedy, and then it waits")

    def allocate(self, search):
        search.submit(greedy(search.instance))
        while not search.should_stop():
            pass
        return Proposal()

registry.BUILT_IN["slow"], registry.TARGETS["slow"] = Slow.method, "__main__:Slow"
module = importlib.import_module("alloc.allocators.solve")
inner = module.signals_set

@contextlib.contextmanager
def announced(stop):
    with inner(stop):
        print("READY", file=sys.stderr, flush=True)
        yield

module.signals_set = announced
from alloc.cli.main import main
sys.exit(main())
"""
"""Runs the command line, with one more method, and says when the solve has begun."""


@pytest.fixture(scope="module")
def hard(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An instance that no method finishes within seconds."""
    path = tmp_path_factory.mktemp("hard") / "hard.json"
    family = Family(agents=60, tasks=23, ability="lognormal", ability_max=40.0, integer=False)
    write_instance(random_instance(family, 4), path)
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "number"),
    [
        ("slow", signal.SIGINT),
        ("slow", signal.SIGTERM),
        ("ga", signal.SIGINT),
        ("cpsat", signal.SIGTERM),
        ("milp", signal.SIGINT),
    ],
)
def test_signal_ends_the_run_with_the_incumbent(hard, tmp_path, method, number):
    """Ctrl-C or SIGTERM during a run prints and saves the best allocation at once, with the usual exit code."""
    command = ["solve", str(hard), "--method", method, "--time-limit", "60", "--json", "--output", "best.json"]
    process = subprocess.Popen(
        [sys.executable, "-c", LAUNCHER, *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    assert process.stderr is not None
    assert process.stderr.readline() == "READY\n"
    time.sleep(1.5 if method in ("cpsat", "milp") else 0.3)  # a model takes a second, and then it is in native code
    assert process.poll() is None, "it ended before it could be interrupted"
    began = time.monotonic()
    process.send_signal(number)
    out, err = process.communicate(timeout=20)
    took = time.monotonic() - began
    result = json.loads(out)
    assert (result["stop_reason"], process.returncode) == ("interrupted", 0)
    assert json.loads((tmp_path / "best.json").read_text()) == result
    assert "Traceback" not in err
    assert took < PATIENCE_S


def test_ctrl_c_outside_a_run_is_one_line(tmp_path):
    """Ctrl-C while waiting for input ends the command with one line and exit code 130."""
    process = subprocess.Popen(
        [sys.executable, "-m", "alloc.cli", "validate", "-"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
    )
    assert process.stdin is not None
    process.stdin.write(" " * 1_000_000)  # more than a pipe holds: this returns once the command reads
    process.stdin.flush()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (130, "", INTERRUPTED)


@pytest.mark.parametrize("module", ["typer", "numpy"])
def test_ctrl_c_while_modules_are_loaded_is_one_line(tmp_path, module):
    """Ctrl-C while modules are loaded gives one line and exit code 130."""
    (tmp_path / f"{module}.py").write_text("import signal; signal.raise_signal(signal.SIGINT)")
    ran = subprocess.run(
        [sys.executable, "-m", "alloc", "solve", "demo.json"],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])},
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (130, "", INTERRUPTED)


def test_interrupt_in_a_callback_is_not_lost(monkeypatch):
    """Ctrl-C in a callback from native code, which cannot propagate exceptions, is repeated."""
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    repeat_lost_interrupts()

    @ctypes.CFUNCTYPE(None)
    def interrupted():
        raise KeyboardInterrupt

    def called():
        interrupted()
        for _ in range(500):
            time.sleep(0.01)

    with pytest.raises(KeyboardInterrupt):
        called()


def test_other_errors_in_a_callback_are_reported(monkeypatch):
    """Only Ctrl-C is repeated; other exceptions in callbacks are reported as usual."""
    reported = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: reported.append(unraisable.exc_type))
    repeat_lost_interrupts()

    @ctypes.CFUNCTYPE(None)
    def failing():
        raise ZeroDivisionError

    failing()
    assert reported == [ZeroDivisionError]
