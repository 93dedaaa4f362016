"""Least energy at T = 1 on the paper's scenarios, by the method that `auto` picks: gap to its own proven bound.

    python tests/benchmarks/exact_energy.py [--seeds 10] [--scenarios 1 2 3 4] [--threads 2]

Prints one row for each scenario: medians over the seeds. Ends with status 1 if a median gap is above 1 %.
"""

import argparse
import sys

import numpy as np

from alloc.allocators import Allocator, load, solve
from alloc.allocators.auto import choose
from alloc.allocators.contract.budget import Budget
from alloc.problems import Objective
from alloc.problems.generate import paper

SECONDS = {1: 3.0, 2: 10.0, 3: 10.0, 4: 30.0}
GOAL = 0.01


def measure(allocator: Allocator, scenario: int, seed: int, threads: int) -> tuple[float, float, float, float]:
    """Gap, energy, bound and seconds of one run."""
    limit = SECONDS[scenario]
    result = solve(paper(scenario, seed), allocator, objective="makespan-energy", time_limit_s=limit, threads=threads)
    assert result.makespan == 1.0, f"scenario {scenario}, seed {seed}: T = {result.makespan}"
    assert result.energy is not None
    assert result.energy_lower_bound is not None
    assert result.energy_gap is not None
    return result.energy_gap, result.energy, result.energy_lower_bound, result.runtime_s


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--scenarios", type=int, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    good = True
    print("| scenario | method | median gap | worst gap | median energy | median bound | median seconds |")
    print("|---|---|---|---|---|---|---|")
    for scenario in options.scenarios:
        name, _ = choose(paper(scenario, 0), Objective.MAKESPAN_ENERGY, Budget(SECONDS[scenario]))
        allocator = load(name)
        rows = [measure(allocator, scenario, seed, options.threads) for seed in range(options.seeds)]
        gap, energy, bound, seconds = np.median(np.array(rows), axis=0)
        worst = max(row[0] for row in rows)
        print(
            f"| {scenario} | {name} | {gap:.2%} | {worst:.2%} | {energy:.2f} | {bound:.2f} | {seconds:.1f} |",
            flush=True,
        )
        good &= gap <= GOAL
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
