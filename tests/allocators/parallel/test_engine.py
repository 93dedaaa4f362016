"""Engines: the same results in the same order if processes die, and no processes left over."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import engine_jobs as jobs
import pytest
import torch

from alloc.allocators.parallel.engine import Engine, EngineError
from alloc.allocators.parallel.engines import make_engine
from alloc.allocators.parallel.processes import ProcessEngine
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems import InputError


def states(count: int) -> list[dict[str, torch.Tensor]]:
    return [{"seed": torch.tensor(seed), "weight": torch.rand(40, 40) * 0 + seed} for seed in range(count)]


def gone(pid: int, within_s: float = 20) -> bool:
    """Whether the process ends in time; a dead one that nobody has waited for is gone as well."""
    end = time.monotonic() + within_s
    while time.monotonic() < end:
        try:
            os.kill(pid, 0)
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False


def when_written(*paths: Path) -> Callable[[], bool]:
    return lambda: all(path.exists() for path in paths)


@pytest.fixture(scope="module")
def pair() -> Iterator[ProcessEngine]:
    """Two processes for many tests: a process takes a second to load torch."""
    with ProcessEngine(2) as engine:
        yield engine


@pytest.fixture(scope="module", params=["serial", "one process", "two processes"])
def engine(request: pytest.FixtureRequest, pair: ProcessEngine) -> Iterator[Engine]:
    with SerialEngine() if request.param == "serial" else ProcessEngine(1) as engine:
        yield pair if request.param == "two processes" else engine


def test_engines_return_the_results_of_a_loop_in_order(engine: Engine) -> None:
    """Every engine returns the same as a loop, bit for bit."""
    assert engine.map(jobs.square, range(7)) == [0, 1, 4, 9, 16, 25, 36]
    assert engine.map(jobs.square, []) == []
    expected = [jobs.step(state) for state in states(4)]
    got = engine.map(jobs.step, states(4))
    assert got is not None
    for a, b in zip(got, expected, strict=True):
        assert a["seed"] == b["seed"]
        assert torch.equal(a["weight"], b["weight"])


def test_workers_are_reused_until_closed() -> None:
    """One item starts one of ten processes, the next reuses it, and closing, even twice, ends it."""
    with ProcessEngine(10) as engine:
        first, second = engine.map(jobs.pid, [0]), engine.map(jobs.pid, [0])
    engine.close()
    assert first is not None
    assert first == second
    assert gone(first[0], 0.1)


def test_workers_import_only_what_their_items_need() -> None:
    """Torch, which takes seconds to load, is not loaded in a worker whose items do not use it."""
    with ProcessEngine(1) as engine:
        assert engine.map(eval, ["'torch' in __import__('sys').modules"]) == [False]


@pytest.mark.slow
def test_items_of_killed_workers_are_repeated(tmp_path: Path, pair: ProcessEngine) -> None:
    """Items whose process is killed at the first attempt succeed at the second, and others are not affected."""
    items = [(number, str(tmp_path / str(number))) for number in range(4)]
    results = pair.map(jobs.die_first, items)
    assert results is not None
    assert [square for square, _ in results] == [0, 1, 4, 9]
    assert len(list(tmp_path.iterdir())) == 2


def test_item_that_always_kills_its_worker_is_an_error(tmp_path: Path) -> None:
    """After the last attempt there is one error; being killed while idle does not count; the engine stays usable."""
    with ProcessEngine(1, max_attempts=2) as engine:
        with pytest.raises(EngineError, match=r"died 2 times .* \(exit code -9\)"):
            engine.map(jobs.die, [str(tmp_path / "tries")])
        assert (tmp_path / "tries").read_text().count("tried") == 2
    with ProcessEngine(1, max_attempts=1) as engine:
        first = engine.map(jobs.pid, [0])
        assert first is not None
        os.kill(first[0], signal.SIGKILL)
        while engine._workers[0].alive:  # its threads may outlive its first one for a moment
            time.sleep(0.01)
        assert engine.map(jobs.square, [3]) == [9]


def test_exceptions_of_the_function_are_raised_in_the_caller(engine: Engine) -> None:
    """They keep their type, and include the traceback of the worker."""
    with pytest.raises(KeyError, match="item 5") as caught:
        engine.map(jobs.fail, [5])
    if isinstance(engine, ProcessEngine):
        assert "engine_jobs.py" in caught.value.__notes__[0]
    with pytest.raises((RuntimeError, jobs.UnpicklableError), match="of two parts"):
        engine.map(jobs.fail_oddly, [5])


@pytest.mark.slow
def test_stop_request_drops_items_in_progress(tmp_path: Path, pair: ProcessEngine) -> None:
    """`map` returns None at once, its workers end, and the engine can be used again."""
    markers = [tmp_path / name for name in ("a", "b")]
    assert pair.map(jobs.sleep_long, [str(marker) for marker in markers], when_written(*markers)) is None
    assert all(gone(int(marker.read_text())) for marker in markers)
    assert pair.map(jobs.square, [3]) == [9]


def test_serial_engine_stops_between_items() -> None:
    """It checks for a stop request before every item."""
    answers = iter([False, False, True])
    assert SerialEngine().map(jobs.square, range(9), lambda: next(answers)) is None


SCRIPT = """
import sys, threading
import engine_jobs as jobs
from alloc.allocators.runtime.interrupts import signals_set
from alloc.allocators.parallel.processes import ProcessEngine
if __name__ == "__main__":
    stop = threading.Event()
    with signals_set(stop), ProcessEngine(2) as engine:
        print(engine.map(jobs.sleep_long, sys.argv[1:], stop.is_set))
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL], ids=lambda number: number.name)
def test_no_orphaned_workers(number: signal.Signals, tmp_path: Path) -> None:
    """Ctrl-C of a process group, SIGTERM and SIGKILL of the parent end the workers; the first two cleanly."""
    script, markers = tmp_path / "script.py", [tmp_path / name for name in ("a", "b")]
    script.write_text(SCRIPT)
    path = [str(Path(jobs.__file__).parent), os.environ.get("PYTHONPATH", "")]
    parent = subprocess.Popen(
        [sys.executable, str(script), *map(str, markers)],
        env=os.environ | {"PYTHONPATH": os.pathsep.join(path)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    written = when_written(*markers)
    while parent.poll() is None and not written():
        time.sleep(0.05)
    if number == signal.SIGINT:
        os.killpg(parent.pid, number)
    else:
        parent.send_signal(number)
    output, errors = parent.communicate(timeout=30)
    assert all(gone(int(marker.read_text())) for marker in markers)
    assert errors == ""
    if number != signal.SIGKILL:
        assert (output, parent.returncode) == ("None\n", 0)


def test_ctrl_c_does_not_reach_starting_workers() -> None:
    """A process that is still starting cannot handle a signal, and does not receive it."""
    results: list[list[int] | None] = []
    with ProcessEngine(1) as engine:
        thread = threading.Thread(target=lambda: results.append(engine.map(jobs.square, [3])))
        thread.start()
        while not engine._workers:
            time.sleep(0.001)
        pid = engine._workers[0]._process.pid
        assert pid is not None
        os.kill(pid, signal.SIGINT)
        thread.join()
    assert results == [[9]]


def test_make_engine_refuses_invalid_options() -> None:
    """Each error is one line that names its option."""
    assert isinstance(make_engine(), SerialEngine)
    with make_engine("processes", workers=2) as engine:
        assert isinstance(engine, ProcessEngine)
    with pytest.raises(InputError, match=r"engine: no such engine: 'process' \(did you mean 'processes'\?\)"):
        make_engine("process")
    with pytest.raises(InputError, match="workers: belongs to the engine processes"):
        make_engine("serial", workers=2)
    with pytest.raises(InputError, match="address: belongs to the engine ray"):
        make_engine("processes", address="auto")
