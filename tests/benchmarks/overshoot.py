"""By how much short time limits are exceeded: p50, p99 and worst of each anytime method, in milliseconds.

    python tests/benchmarks/overshoot.py --calls 1000

Times are those from the call of `solve` to its result, with the bounds that follow the run, less the limit. With
`--processor` all clocks of the process, that of the budgets too, count its processor time, of which others on a busy
machine take none: a run in one thread hardly waits. Native solvers keep to the wall clock, but are stopped by ours.
"""

import argparse
import gc
import os
import time

import numpy as np

from alloc.allocators import Allocator, RefusedError, describe, load, names, solve
from alloc.problems import Instance
from alloc.problems.generate import paper, paper_like

SIZES = {"30/8": paper_like(30, 8, 120, seed=1), "100/20": paper(1, seed=1), "500/50": paper(4, seed=1)}
LIMITS_MS = (20, 50, 100)
GOAL = "makespan-energy"
"""With energy no method is done at once."""


def overshoot(instance: Instance, method: Allocator, limit_ms: float, calls: int) -> str:
    """Return p50, p99 and worst of the milliseconds beyond the limit."""
    times = []
    for seed in range(-2, calls):  # the first two are in vain
        begin = time.monotonic()
        try:
            solve(instance, method, objective=GOAL, time_limit_s=limit_ms / 1000, seed=abs(seed), threads=1)
        except RefusedError:
            return "refused"
        times.append(1000 * (time.monotonic() - begin) - limit_ms)
    return "{:.1f}, {:.1f}, {:.1f}".format(*np.percentile(times[2:], [50, 99, 100]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--methods", nargs="+", default=[name for name in names() if describe(name).anytime])
    parser.add_argument("--sizes", nargs="+", default=list(SIZES))
    parser.add_argument("--processor", action="store_true", help="processor time")
    options = parser.parse_args()
    if options.processor:
        time.monotonic = time.process_time
    print(f"{options.calls} calls each, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    print("| method | size | " + " | ".join(f"{limit} ms: p50, p99, worst" for limit in LIMITS_MS) + " |")
    print("|---" * (2 + len(LIMITS_MS)) + "|")
    gc.freeze()
    for name, (size, instance) in ((name, (one, SIZES[one])) for name in options.methods for one in options.sizes):
        method = load(name)
        cells = [overshoot(instance, method, limit, options.calls) for limit in LIMITS_MS]
        print(f"| {name} | {size} | {' | '.join(cells)} |", flush=True)
