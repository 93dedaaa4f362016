"""Seconds from an instance in memory to the first answer of a loaded policy, and how good that answer is.

    taskset -c 1 python tests/benchmarks/first_answer.py --methods gappo,gappo-ls,ppo,a2c,dqn,ddpg --publish

Policies are loaded once and have run once; each instance is new. Runs end at their first answer, but are told
--time-limit seconds, as they would be in use. Exits with 1 if the median or the T of `gappo` misses what was set.
"""

import argparse
import sys

import numpy as np
from learned_runs import Row, add_options, crossed, known, publish, run, table

AIMS = {"paper-1": 0.03, "paper-4": 0.3}
"""Seconds that `gappo` may take, by scenario."""

MOST_T = 1.04
SIZES = {"paper-1": "100/20", "paper-4": "500/50"}
HEAD = "agents/tasks | method | median ms: | worst ms: | T mean: | T worst: |"


def line(family: str, method: str, rows: list[Row]) -> list[str]:
    """Return the row of a method."""
    answered = [row for row in rows if not row.why]
    if not answered:
        return [SIZES[family], method, "-", "-", "-", "-", rows[0].why]
    times = 1000 * np.array([row.first_seconds for row in answered])
    makespan = np.array([row.first_makespan for row in answered])
    missing = len(rows) - len(answered)
    ends = [f"{np.median(times):.1f}", f"{times.max():.1f}", f"{makespan.mean():.4f}", f"{makespan.max():.4f}"]
    return [SIZES[family], method, *ends, f"{missing} without" if missing else ""]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, methods="gappo,gappo-ls,ppo,a2c,dqn,ddpg,greedy,local-search,ga,hedonic", seeds=20)
    parser.add_argument("--time-limit", type=float, default=1.0, help="seconds")
    options = parser.parse_args()
    methods = known(options.methods)
    tasks = crossed(["makespan-energy"], SIZES, options.seeds, [options.time_limit], options.threads, methods)
    rows = run(tasks, jobs=options.jobs, kept=options.runs, again=options.again.split(","), first=True)
    lines, good = [], True
    for family, seconds in AIMS.items():
        for method in methods:
            found = [row for row in rows if (row.task.family, row.task.method) == (family, method)]
            lines.append(line(family, method, found))
            if method == "gappo":
                quick = np.median([row.first_seconds for row in found]) <= seconds
                good &= bool(quick and np.mean([row.first_makespan for row in found]) <= MOST_T)
    text = table(HEAD, lines)
    print(text)
    if options.publish:
        publish("first_answer.py", f"{options.seeds} instances each, one thread.\n\n{text}")
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
