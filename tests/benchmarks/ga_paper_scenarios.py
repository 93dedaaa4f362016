"""Makespan and time of `ga` on the paper's scenarios, as a table.

    python tests/benchmarks/ga_paper_scenarios.py --scenarios 1 4 --seeds 20 --objective makespan

Processor time is shown beside wall-clock time, as the latter says little on a busy machine.
"""

import argparse
import time

import numpy as np

from alloc.allocators import load, solve
from alloc.problems.generate import paper

TIME_LIMIT_S = {1: 10.0, 2: 30.0, 3: 30.0, 4: 30.0}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenarios", type=int, nargs="+", default=[1, 2, 3, 4], choices=[1, 2, 3, 4])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--time-limit", type=float, help="seconds; 10 in scenario 1 and 30 in the others by default")
    parser.add_argument("--objective", default="makespan", choices=["makespan", "makespan-energy"])
    options = parser.parse_args()
    allocator = load("ga")
    energetic = options.objective == "makespan-energy"
    print(f"{'scenario':>8} {'seeds':>5} {'mean T':>8} {'worst T':>8} {'T = 1':>6} {'wall s':>7} {'cpu s':>7}", end="")
    print(f" {'energy / LP bound':>18}" if energetic else "")
    for scenario in options.scenarios:
        limit, begin = options.time_limit or TIME_LIMIT_S[scenario], time.process_time()
        results = [
            solve(paper(scenario, seed), allocator, objective=options.objective, time_limit_s=limit, threads=1)
            for seed in range(options.seeds)
        ]
        spent = (time.process_time() - begin) / options.seeds
        makespans = np.array([result.makespan for result in results])
        wall = np.mean([result.runtime_s for result in results])
        line = f"{scenario:>8} {options.seeds:>5} {makespans.mean():>8.5f} {makespans.max():>8.5f}"
        line += f" {(makespans < 1 + 1e-9).mean():>6.0%} {wall:>7.2f} {spent:>7.2f}"
        if energetic:
            bounds = [(r.energy, r.energy_lower_bound) for r in results if r.energy_lower_bound]
            line += f" {np.mean([energy / bound for energy, bound in bounds]):>18.3f}" if bounds else f" {'-':>18}"
        print(line, flush=True)


if __name__ == "__main__":
    main()
