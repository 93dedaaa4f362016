"""How fast each method is in one checkout against another: the same runs in turn, A B B A, and the ratios pair by pair.

    python tests/benchmarks/speed_of_versions.py FOLDER_A FOLDER_B [--pairs 15] [--methods ga,gappo]

A folder holds a link `alloc` to a checkout. Two processes, one for each version, load a method once and solve the same
instance whenever they are told; budgets count iterations, and the exact methods run until they have a proof. Seconds
are those of the process on its processors, so that other programs disturb less than a clock on the wall.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path
from typing import IO

ITERATIONS = {
    "ga": 40,
    "hedonic": 400,
    "auction": 2000,
    "local-search": 40,
    "gappo-ls": 40,
    "lp-round": 20,
}
"""Of each method that is not run for `FEW`."""

GREEDY_RUNS = 200
"""In a row, as one takes a millisecond."""

FEW = 12

WORKER = """
import json, sys, time
from alloc.allocators import load, solve
from alloc.problems import paper
name, iterations, repeats, seed = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
method, instance = load(name), paper(1, seed)
exact = method.method.kind == "exact"
objective = "makespan" if exact or name == "greedy" else "makespan-energy"

def run():
    begin = time.process_time()
    for _ in range(repeats):
        budget = {"time_limit_s": None, "iterations": iterations}
        result = solve(instance, method, objective=objective, seed=1, threads=1, **budget)
    return [time.process_time() - begin, result.makespan, result.energy]

run()
print("ready", flush=True)
for _ in sys.stdin:
    print(json.dumps(run()), flush=True)
"""


class Version:
    """One checkout with one method loaded, in a process of its own."""

    def __init__(self, folder: Path, name: str, seed: int) -> None:
        repeats = {"greedy": GREEDY_RUNS, "cpsat": 5, "milp": 5, "lp-round": 3}.get(name, 1)
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER, name, str(ITERATIONS.get(name, FEW)), str(repeats), str(seed)],
            env={**os.environ, "PYTHONPATH": str(folder), "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._output.readline() == "ready\n", f"{name} of {folder} does not run"

    @property
    def _output(self) -> IO[str]:
        assert self._process.stdout is not None
        return self._process.stdout

    def run(self) -> list[float]:
        """Solve once; return seconds, makespan and energy."""
        assert self._process.stdin is not None
        self._process.stdin.write("run\n")
        self._process.stdin.flush()
        figures: list[float] = json.loads(self._output.readline())
        return figures

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()


def main() -> None:
    """Print the median ratio B / A for each method, and whether both found the same."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("a", type=Path)
    parser.add_argument("b", type=Path)
    parser.add_argument("--pairs", type=int, default=15)
    parser.add_argument("--seed", type=int, default=0)
    every = "greedy,local-search,milp,cpsat,ga,hedonic,auction,lp-round,gappo,gappo-ls,ppo,a2c,dqn,ddpg"
    parser.add_argument("--methods", default=every)
    arguments = parser.parse_args()
    for name in arguments.methods.split(","):
        a, b = (Version(folder, name, arguments.seed) for folder in (arguments.a, arguments.b))
        ratios, seconds, same = [], [], True
        for pair in range(arguments.pairs):
            first, second = (a, b) if pair % 2 else (b, a)
            one, other = first.run(), second.run()
            if not pair % 2:
                one, other = other, one
            ratios.append(other[0] / one[0])
            seconds.append(one[0])
            same = same and one[1:] == other[1:]
        a.close()
        b.close()
        told = f"{statistics.median(ratios):.3f} ({min(ratios):.3f} to {max(ratios):.3f})"
        print(f"{name:13} {statistics.median(seconds):8.4f} s  ratio {told}  {'same' if same else 'OTHER'}", flush=True)


if __name__ == "__main__":
    main()
