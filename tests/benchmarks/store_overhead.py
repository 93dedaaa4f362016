"""What a store and processes cost: runs of a campaign against the same runs by bare calls of `solve`, all cores busy.

    python tests/benchmarks/store_overhead.py --limits 1 0.1 --runs 60 600

The method uses its processor until the time limit. Bare calls are made by as many processes, pinned alike, one after
the other; both are timed from the first run to the end of the last, without the start of processes. The processor time
of the command itself, which takes turns with the runs, is told too.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / "allocators" / "experiments")]

import evil_methods  # noqa: E402

from alloc.allocators.experiments.campaign import Campaign, Job, Means  # noqa: E402
from alloc.allocators.experiments.store.key import Run, fingerprint, this_machine, versions  # noqa: E402
from alloc.allocators.experiments.store.store import Store  # noqa: E402
from alloc.problems import Family, random_instance  # noqa: E402

BARE = """
import json, os, sys, time
from alloc.allocators import load, solve
from alloc.problems import Family, random_instance
core, runs, limit = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
os.sched_setaffinity(0, [core])
instance, method = random_instance(Family(), 0), load("busy")
solve(instance, method, time_limit_s=0.1, threads=1)
sys.stdout.write("ready\\n"); sys.stdout.flush(); sys.stdin.readline()
begin = time.monotonic()
for seed in range(runs):
    solve(instance, method, time_limit_s=limit, threads=1, seed=seed)
print(json.dumps(time.monotonic() - begin))
"""


def bare(cores: list[int], runs: int, limit: float) -> float:
    """Return the seconds that each of several processes takes for its part of the runs, the slowest."""
    part = str(runs // len(cores))
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    made = [subprocess.Popen([sys.executable, "-c", BARE, str(core), part, str(limit)], **pipes) for core in cores]
    for process in made:
        process.stdout.readline()
    for process in made:
        process.stdin.write("\n")
        process.stdin.flush()
    return max(json.loads(process.communicate()[0]) for process in made)


def kept(workers: int, runs: int, limit: float) -> tuple[float, float]:
    """Return the seconds from the first run of a campaign to the end of its last one, and its own processor time."""
    instance = random_instance(Family(), 0)
    same = {"instance": fingerprint(instance), "method": "busy", "parameters": "{}", "objective": "makespan"}
    same |= {"iterations": None, "target_gap": None, "threads": 1, "version": versions("busy")}
    wanted = [Run(seed=seed, time_limit_s=limit, machine=this_machine(), **same) for seed in range(runs)]
    with tempfile.TemporaryDirectory(dir=".") as folder, Store(Path(folder) / "runs.db") as store:
        campaign = Campaign(store, [Job(run, {}, instance) for run in wanted], Means(workers))
        before = resource.getrusage(resource.RUSAGE_SELF)
        campaign.run(threading.Event())
        after = resource.getrusage(resource.RUSAGE_SELF)
        rows = sorted((one.ending.finished_at, one.ending) for one in store.records().values())
    assert all(ending.outcome == "solved" for _, ending in rows), rows[0]
    # the first run of each process waits for its start: counted from the end of these on
    first, last = rows[workers - 1][0], rows[-1][0]
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return (last - first) * runs / (runs - workers), spent


def main() -> None:
    """Measure, alternately, and print a line for each time limit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--limits", type=float, nargs="+", default=[1.0, 0.1], help="seconds of a run")
    parser.add_argument("--runs", type=int, nargs="+", default=[60, 600], help="runs with each limit")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        evil_methods.install(Path(folder))
        sys.path.insert(0, folder)
        os.environ["PYTHONPATH"] = f"{folder}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
        cores = sorted(os.sched_getaffinity(0))
        for limit, runs in zip(options.limits, options.runs, strict=True):
            begin = time.strftime("%H:%M")
            alone = bare(cores, runs, limit)
            seconds, spent = kept(len(cores), runs, limit)
            print(
                f"{begin}: {runs} runs of {limit:g} s on {len(cores)} cores: bare {alone:.2f} s, kept {seconds:.2f} s, "
                f"{100 * (seconds / alone - 1):+.1f} %; {1000 * spent / runs:.1f} ms of processor time each",
                flush=True,
            )


if __name__ == "__main__":
    main()
