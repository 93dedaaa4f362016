"""Exact methods on the paper's scenarios, with and without their descent, and a naive model in the same run.

    python tests/benchmarks/exact_paper_scenarios.py --seeds 20

Exits with 1 unless T = 1 is proven everywhere, `runtime_s` has a mean under 0.3 s and stays under 2 s, and both methods
are at least 20 times faster than the naive model in scenario 1.
"""

import argparse
import sys
import time

import cvxpy as cp
import numpy as np

from alloc.allocators import Allocator, solve
from alloc.allocators.exact.cpsat import CpSat
from alloc.allocators.exact.milp import Milp
from alloc.problems import Allocation, Instance, evaluate
from alloc.problems.generate import paper, paper_like

METHODS: dict[str, type[CpSat] | type[Milp]] = {"cpsat": CpSat, "milp": Milp}


def naive_model(instance: Instance, time_limit_s: float) -> tuple[float, float]:
    """Decide every e_ij of (5) by cvxpy and HiGHS as they come; return seconds and makespan."""
    begin = time.monotonic()
    e = cp.Variable((instance.n, instance.m), boolean=True)
    pace = cp.Variable()  # 1 / T
    reach = instance.reach.mask[instance.reach.origin].astype(float)
    rules = [instance.ability @ e >= pace * instance.workload, cp.sum(e, axis=1) <= 1, e <= reach]
    cp.Problem(cp.Maximize(pace), rules).solve(solver=cp.HIGHS, highs_options={"time_limit": time_limit_s})
    seconds = time.monotonic() - begin
    chosen = np.round(e.value)
    plan = Allocation(np.where(chosen.any(axis=1), chosen.argmax(axis=1), -1))
    return seconds, evaluate(instance, plan).makespan or np.inf


def measure(allocator: Allocator, scenario: int, seeds: int, time_limit_s: float) -> tuple[int, list[float]]:
    """Return how many seeds are proven optimal at T = 1, and the run times."""
    results = [solve(paper(scenario, seed), allocator, time_limit_s=time_limit_s) for seed in range(seeds)]
    proven = sum(str(result.status) == "optimal" and result.makespan == 1.0 for result in results)
    return proven, [result.runtime_s for result in results]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--naive-seeds", type=int, default=3, help="seeds of scenario 1 for the naive model")
    parser.add_argument("--time-limit", type=float, default=10.0)
    options = parser.parse_args()
    means: dict[str, float] = {}
    good = True
    print("| method | descent | scenario | T = 1 proven | mean s | worst s |\n|---|---|---|---|---|---|")
    for descent in (True, False):
        for name, method in METHODS.items():
            allocator = method(descent=descent)
            solve(paper_like(8, 2, 32, 0), allocator)  # the first call loads parts of the libraries
            for scenario in (1, 2, 3, 4):
                proven, seconds = measure(allocator, scenario, options.seeds, options.time_limit)
                mean, worst = float(np.mean(seconds)), max(seconds)
                print(f"| {name} | {'on' if descent else 'off'} | {scenario} | {proven}/{options.seeds} "
                      f"| {mean:.4f} | {worst:.4f} |", flush=True)  # fmt: skip
                if descent:
                    good &= proven == options.seeds and mean < 0.3 and worst < 2
                means.setdefault(f"{name} {scenario}" if descent else f"{name} {scenario} without descent", mean)
    naive = [naive_model(paper(1, seed), 60.0) for seed in range(options.naive_seeds)]
    slow = float(np.mean([seconds for seconds, _ in naive]))
    print(f"naive e_ij model in scenario 1: {slow:.2f} s, T {[round(makespan, 4) for _, makespan in naive]}")
    for name in METHODS:
        ratio, alone = slow / means[f"{name} 1"], slow / means[f"{name} 1 without descent"]
        print(f"{name}: {ratio:.0f} times faster, {alone:.0f} times without descent")
        good &= ratio >= 20
    return int(not good)


if __name__ == "__main__":
    sys.exit(main())
