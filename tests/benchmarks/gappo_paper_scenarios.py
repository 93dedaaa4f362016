"""How good the shipped policy is on the paper's scenarios, on seeds that training never saw.

    python tests/benchmarks/gappo_paper_scenarios.py --scenario 1 --seeds 20 --time-limit 3

Energy is compared with the least at T = 1: with the bound that `milp` proves for it within --exact-time, so that the
ratio shown is never too small, and with the best plan at T = 1 that `milp` finds.
"""

import argparse

import numpy as np

from alloc.allocators import load, solve
from alloc.problems.generate import paper


def main() -> None:
    """Print one line per seed, and the means."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenario", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--time-limit", type=float, default=3.0)
    parser.add_argument("--exact-time", type=float, default=20.0)
    parser.add_argument("--policy", default=None)
    options = parser.parse_args()
    gappo, milp = load("gappo", policy=options.policy), load("milp")
    rows = []
    print("seed  T first  T      energy  bound at T=1  best at T=1  ratio  ratio to best  runtime")
    for seed in range(options.seeds):
        instance = paper(options.scenario, seed)
        result = solve(instance, gappo, objective="makespan-energy", time_limit_s=options.time_limit, seed=seed)
        exact = solve(instance, milp, objective="makespan-energy", time_limit_s=options.exact_time)
        assert result.makespan is not None
        assert result.energy is not None
        assert exact.makespan == 1.0
        assert exact.energy is not None
        assert exact.energy_lower_bound is not None
        first = result.trace[0].evaluation.served_makespan
        ratio, to_best = result.energy / exact.energy_lower_bound, result.energy / exact.energy
        rows.append((first, result.makespan, ratio, to_best, result.runtime_s, result.trace[0].time_s))
        print(
            f"{seed:4d}  {first:.4f}  {result.makespan:.4f}  {result.energy:6.1f}  {exact.energy_lower_bound:12.1f}  "
            f"{exact.energy:11.1f}  {ratio:.3f}  {to_best:13.3f}  {result.runtime_s:.2f}",
            flush=True,
        )
    first, makespan, ratio, to_best, runtime, first_time = np.mean(rows, axis=0)
    print(
        f"mean: T {makespan:.4f}, energy {ratio:.3f} times the bound and {to_best:.3f} times the best at T = 1, "
        f"runtime {runtime:.2f} s; first answer T {first:.4f} after {first_time * 1000:.0f} ms"
    )


if __name__ == "__main__":
    main()
