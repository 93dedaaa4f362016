"""How long `alloc report` takes on made-up runs: ``python tests/benchmarks/report_scale.py FOLDER 10000 100000``."""

import json
import sqlite3
import sys
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
SAME = {
    "parameters": "{}",
    "objective": "makespan-energy",
    "time_limit_s": 10.0,
    "iterations": None,
    "target_gap": None,
}
PLACES = [(seed, method) for seed in range(5) for method in range(len(METHODS))]


def made_up(rng: np.random.Generator, level: float, agents: int) -> Ending:
    """Return how a run ended: some failed, the others got better over time."""
    times = np.sort(10 ** rng.uniform(-2.5, 1, rng.integers(3, 40)))
    if len(times) == 3:
        return Ending(outcome=Outcome.FAILED, reason="ValueError: made up", details="Traceback\n</script>made up")
    T = level * (1 + 0.3 * rng.random() * np.exp(-np.arange(len(times)) / 3))  # noqa: N806
    trace = tuple(zip(times.tolist(), T.tolist(), (agents * (2 - T / T[0])).tolist(), [None] * len(T), strict=True))
    scores = {"makespan": trace[-1][1], "energy": trace[-1][2], "lower_bound": 0.9, "runtime_s": 10.0, "memory_mb": 9.0}
    return Ending(outcome=Outcome.SOLVED, status="feasible", trace=trace, unserved=0, started_at=1e9, **scores)


def fill(path: Path, runs: int) -> None:
    """Write a store with about so many runs."""
    rng, columns = np.random.default_rng(0), ("key", *RUN, *ENDING)
    insert = f"INSERT INTO runs ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})"
    with Store(path) as store, sqlite3.connect(path) as direct:
        for number in range(runs // len(PLACES)):
            one = random_instance(Family(agents=20 * 2 ** (number % 5), tasks=8), number, name=f"family:{number}")
            same = {**SAME, "instance": store.add(one), "threads": 1, "version": "alloc 0", "machine": "m"}
            for seed, method in PLACES:
                run = Run(method=METHODS[method], seed=seed, **same)
                ending = made_up(rng, 1 + 0.02 * method + 0.05 * rng.random(), one.n)
                row = {**asdict(run), **asdict(ending), "key": run.key, "trace": json.dumps(ending.trace)}
                direct.execute(insert, [row[c] for c in columns])
                plan = run.key, packed(Allocation(rng.integers(0, one.m, one.n)))
                direct.execute("INSERT INTO plans VALUES (?, ?)", plan)
            direct.commit()


for runs in map(int, sys.argv[2:]):
    store, page = (Path(sys.argv[1]) / f"made-up-{runs}.{suffix}" for suffix in ("db", "html"))
    if not store.exists():
        fill(store, runs)
    begin, before = time.monotonic(), time.process_time()
    report_html([store], page)
    took = f"{time.monotonic() - begin:.1f} s, {time.process_time() - before:.1f} s of processor time"
    print(f"{runs} runs: {took}, {page.stat().st_size / 1e6:.2f} MB", flush=True)
