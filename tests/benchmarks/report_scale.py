"""How long `alloc report` takes, and how large its page is: on stores whose runs are made up.

python tests/benchmarks/report_scale.py --runs 10000 100000 --folder pages
"""

import argparse
import json
import sqlite3
import time
from dataclasses import asdict
from pathlib import Path

import numpy as np

from alloc.allocators import report_html
from alloc.allocators.experiments.store.key import Run
from alloc.allocators.experiments.store.outcome import Ending, Outcome
from alloc.allocators.experiments.store.plan import packed
from alloc.allocators.experiments.store.store import ENDING, RUN, Store
from alloc.problems import Allocation, Family, random_instance

METHODS = ("greedy", "local-search", "ga", "milp", "cpsat", "hedonic", "auction", "gappo")
CONDITIONS = {
    "objective": "makespan-energy",
    "time_limit_s": 10.0,
    "iterations": None,
    "target_gap": None,
    "threads": 1,
}
SEEDS = 5
DETAILS = 'Traceback (most recent call last):\n  File "method.py", line 1\nValueError: </script><b>made up</b>'


def made_up(rng: np.random.Generator, level: float, agents: int) -> Ending:
    """Return how a run ended: one in fifty failed, the others got better over time."""
    if rng.random() < 0.02:
        return Ending(outcome=Outcome.FAILED, reason="ValueError: </script>made up", details=DETAILS, wall_s=1.0)
    times = np.sort(10 ** rng.uniform(-2.5, 1, rng.integers(3, 40)))
    course = level * (1 + 0.3 * rng.random() * np.exp(-np.arange(len(times)) / 3))
    trace = tuple(
        (t, T, agents * (2 - T / course[0]), None) for t, T in zip(times.tolist(), course.tolist(), strict=True)
    )
    scores = {"makespan": trace[-1][1], "energy": trace[-1][2], "lower_bound": 0.9, "unserved": 0, "status": "feasible"}
    used = {"runtime_s": 10.0, "wall_s": 10.0, "cpu_s": 9.9, "memory_mb": 200.0 + agents, "cores": "0"}
    return Ending(outcome=Outcome.SOLVED, stop_reason="time_limit", trace=trace, **scores, **used)


def fill(path: Path, runs: int) -> None:
    """Write a store with about so many runs."""
    rng, columns = np.random.default_rng(0), ("key", *RUN, *ENDING)
    with Store(path) as store, sqlite3.connect(path, isolation_level=None) as direct:
        for number in range(runs // (SEEDS * len(METHODS))):
            instance = random_instance(
                Family(agents=int(20 * 2 ** (number % 5)), tasks=8), number, name=f"family:{number}"
            )
            known, rows, plans = store.add_instance(instance), [], []
            for place in range(SEEDS * len(METHODS)):
                seed, method = divmod(place, len(METHODS))
                run = Run(
                    instance=known,
                    method=METHODS[method],
                    parameters="{}",
                    seed=seed,
                    version="alloc 0",
                    machine="m",
                    **CONDITIONS,
                )
                ending = made_up(rng, 1 + 0.02 * method + 0.05 * rng.random(), instance.n)
                values = {
                    **asdict(run),
                    **asdict(ending),
                    "key": run.key,
                    "started_at": 1e9 + len(rows),
                    "trace": json.dumps(ending.trace),
                }
                rows.append([values[column] for column in columns])
                plans.append((run.key, packed(Allocation(rng.integers(0, instance.m, instance.n)))))
            direct.execute("BEGIN")
            direct.executemany(
                f"INSERT INTO runs ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})", rows
            )
            direct.executemany("INSERT INTO plans VALUES (?, ?)", plans)
            direct.execute("COMMIT")


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--runs", type=int, nargs="+", default=[10_000], help="runs in each store")
parser.add_argument("--folder", type=Path, default=Path(), help="where stores and pages go")
options = parser.parse_args()
for runs in options.runs:
    store, page = options.folder / f"made-up-{runs}.db", options.folder / f"made-up-{runs}.html"
    if not store.exists():
        fill(store, runs)
    begin, before = time.monotonic(), time.process_time()
    report_html([store], page)
    took, spent = time.monotonic() - begin, time.process_time() - before
    print(
        f"{runs} runs: {took:.1f} s ({spent:.1f} s of processor time), {page.stat().st_size / 1e6:.2f} MB", flush=True
    )
