"""Stress test of a store: two commands work on it and are killed at random times."""

import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import evil_methods

PATIENCE_S = 20.0

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


@dataclass(frozen=True)
class Killed:
    """What came of it.

    Attributes
    ----------
    kills : int
    rows, solved : int
        Runs in the store, and those with a result.
    lost : int
        Runs that are not in the store.
    overlapping : int
        Runs that two processes had in hand at the same time.
    again : int
        Runs that were begun again after their row was written.
    leases : int
        Leases that are left.
    stubborn : int
        Commands that went on for `PATIENCE_S` after a signal, and were killed then.
    begun : int
        Runs that were begun, among them those that were killed.
    seconds : float
    """

    kills: int
    rows: int
    solved: int
    lost: int
    overlapping: int
    again: int
    leases: int
    stubborn: int
    begun: int
    seconds: float


def kill_often(folder, *, seeds, kills, nap_s, workers=2, gap_s=(0.0, 3.0), signals=SIGNALS, seed=0):
    """Run comparisons by two commands, killed repeatedly, until all runs are complete, and check the store."""
    for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
        if signal.getsignal(number) is signal.SIG_IGN:  # in the background of a shell, or by nohup
            signal.signal(number, handler)
    plugin = folder / "plugin"
    plugin.mkdir()
    evil_methods.install(plugin)
    path = f"{plugin}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
    environment = os.environ | {"NAPS": str(folder / "naps"), "NAP_S": str(nap_s), "PYTHONPATH": path}
    command = [sys.executable, "-m", "alloc.cli", "compare", "random[agents=3,tasks=2]:0-3", "--methods", "nap"]
    command += ["--seeds", str(seeds), "--iterations", "1", "--store", str(folder / "runs.db")]
    command += ["--workers", str(workers)]

    def start():
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        return subprocess.Popen(command, env=environment, start_new_session=True, **quiet)

    draw, begin, done, stubborn = random.Random(seed), time.monotonic(), 0, 0
    running = [start(), start()]
    while done < kills:
        time.sleep(draw.uniform(*gap_s))
        victim = draw.randrange(2)
        if running[victim].poll() is None:
            running[victim].send_signal(draw.choice(signals))
            done += 1
        elif running[victim].returncode != 0:
            raise RuntimeError(running[victim].stderr.read().decode())
        elif running[1 - victim].poll() == 0:
            break  # all runs are there
        try:
            running[victim].communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            stubborn += 1
            running[victim].kill()
            running[victim].communicate()
        running[victim] = start()
    errors = [process.communicate()[1].decode() for process in running]
    if any(process.returncode for process in running):
        raise RuntimeError("\n".join(errors))
    return _judged(folder, 4 * seeds, done, stubborn, time.monotonic() - begin)


def _judged(folder, wanted, kills, stubborn, seconds):
    store = sqlite3.connect(folder / "runs.db")
    outcomes = Counter(outcome for (outcome,) in store.execute("SELECT outcome FROM runs"))
    names = "SELECT name, seed, started_at, finished_at FROM runs JOIN instances USING (instance)"
    written = {(name, str(seed)): finished for name, seed, _, finished in store.execute(names)}
    (leases,) = store.execute("SELECT count(*) FROM leases").fetchone()
    store.close()
    begun, ended = [], {}
    for line in Path(folder / "naps").read_text().splitlines():
        what, name, seed, pid, at = line.split()
        if what == "begin":
            begun.append((name, seed, pid, float(at)))
        else:
            ended.setdefault((name, seed), []).append((float(at), pid))
    again = sum(at > written[name, seed] for name, seed, _, at in begun)
    return Killed(
        kills=kills,
        rows=sum(outcomes.values()),
        solved=outcomes["solved"],
        lost=wanted - sum(outcomes.values()),
        overlapping=_overlapping(begun, ended),
        again=again,
        leases=leases,
        stubborn=stubborn,
        begun=len(begun),
        seconds=seconds,
    )


def _overlapping(begun, ended):
    """Return how many runs started in one process while the same run was in progress in another."""
    count = 0
    for name, seed, pid, at in begun:
        ends = [(end, other) for end, other in ended.get((name, seed), []) if other != pid]
        starts = {other: start for n, s, other, start in begun if (n, s) == (name, seed) and other != pid}
        count += any(starts[other] < at < end for end, other in ends)
    return count
