"""The program ends, or gets Ctrl-C, while another thread solves: it does not crash, and no answer is lost."""

import signal
import subprocess
import sys

import pytest

from alloc.allocators.parallel.pool import Pool

PROGRAM = """
import os, sys, threading, time
from alloc.allocators import load, solve
from alloc.problems.generate import paper

instance, method, after_s = paper(4, seed=3), load(sys.argv[1]), float(sys.argv[2])
if sys.argv[1] == "gappo":
    from alloc.allocators.learned import policy
    from alloc.allocators.learned.search.fine_tuning import FineTuning, FineTuningParameters
    policy.FineTuning = lambda *given: FineTuning(*given, FineTuningParameters(after_s=0.3))

def work():
    for _ in range(int(sys.argv[4])):
        result = solve(instance, method, objective="makespan-energy", time_limit_s=1.5, threads=2)
        print(f"{result.stop_reason} {result.allocation is not None}", flush=True)

thread = threading.Thread(target=work, daemon=sys.argv[3] == "daemon")
thread.start()
if sys.argv[3] == "interrupted":
    threading.Timer(after_s, lambda: os.kill(os.getpid(), 2)).start()
    thread.join()
time.sleep(after_s)
"""


MILP = pytest.param("milp", marks=pytest.mark.slow)
GAPPO = pytest.param("gappo", marks=pytest.mark.slow)

ENDS = [
    pytest.param("gappo", 0.0, marks=pytest.mark.slow),
    pytest.param("gappo", 0.8, marks=pytest.mark.slow),
    pytest.param("milp", 0.0, marks=pytest.mark.slow),
    pytest.param("milp", 0.8, marks=pytest.mark.slow),
]
"""Methods, and seconds after which the main thread ends."""


def run(method: str, after_s: float, how: str, times: int = 1) -> subprocess.CompletedProcess[str]:
    """Solve in a thread, in 1.5 s a run, and end the main thread after so many seconds; `gappo` learns from 0.3 s."""
    command = [sys.executable, "-c", PROGRAM, method, str(after_s), how, str(times)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize("method", [MILP, pytest.param("cpsat", marks=pytest.mark.slow), GAPPO, "local-search"])
def test_daemon_thread_is_stopped_and_awaited(method: str) -> None:
    """Its run ends as by a stop event, further runs do not start, and nothing crashes."""
    ran = run(method, 0.8, "daemon", 1000)
    assert (ran.returncode, ran.stderr) == (0, "")
    assert set(ran.stdout.split("\n")) <= {"interrupted True", "proven True", "finished True", ""}


@pytest.mark.slow
def test_interrupted_join_does_not_crash() -> None:
    """After Ctrl-C in `join` some versions of Python consider the other thread ended: no abort."""
    ran = run("milp", 0.8, "interrupted")
    assert ran.returncode in (-signal.SIGINT, 130), ran.stderr
    assert ran.stderr.rstrip().endswith("KeyboardInterrupt")


@pytest.mark.parametrize(("method", "after_s"), ENDS)
def test_joined_thread_keeps_its_time_limit(method: str, after_s: float) -> None:
    """The end of the program waits for it, although pools no longer accept work by then."""
    ran = run(method, after_s, "joined")
    assert (ran.returncode, ran.stderr) == (0, "")
    assert ran.stdout == "time_limit True\n"


@pytest.mark.slow
def test_run_can_start_at_exit() -> None:
    """A handler of `atexit`, registered before or after, may still solve."""
    program = """
import atexit
from alloc.problems import Instance
def late():
    from alloc.allocators import solve
    print(solve(Instance(ability=[1, 2, 3], workload=[3, 2]), "milp", time_limit_s=2, threads=2).status)
atexit.register(late)
from alloc.allocators import solve
solve(Instance(ability=[1, 2], workload=[3, 2]), "milp", time_limit_s=2)
atexit.register(late)
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "optimal\noptimal\n", "")


def test_pool_without_threads_runs_in_the_caller() -> None:
    """After shutdown, work is done in the calling thread, and exceptions are raised by the future."""
    pool = Pool(2)
    pool.shutdown()
    assert list(pool.map(lambda number: number + 1, [1, 2])) == [2, 3]
    with pytest.raises(ZeroDivisionError):
        pool.submit(lambda: 1 / 0).result()
