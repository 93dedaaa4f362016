"""Exact methods against brute force on random tiny instances: prints a table, exits with 1 on any mismatch.

python tests/benchmarks/exact_vs_brute_force.py --count 300
"""

import argparse
import sys
from itertools import count, islice
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from oracle import Optimum, brute_force
from tiny_instances import tiny_instance

from alloc.allocators import Result, load, solve

WAYS = [(load(method), goal) for method in ("cpsat", "milp") for goal in ("makespan", "makespan-energy")]


def mismatch(result: Result, best: Optimum) -> str | None:
    """Return in what `result` differs from the optimum, or None."""
    score, expected = result.evaluation, "infeasible" if best.unserved else "optimal"
    if score is None or score.violations:
        return "no plan, or one that breaks a rule"
    if str(result.status) != expected or len(score.unserved_tasks) != best.unserved:
        return f"{result.status} with {len(score.unserved_tasks)} unserved, not {expected} with {best.unserved}"
    if abs(score.served_makespan - best.makespan) > 1e-6 * best.makespan:
        return f"makespan {score.served_makespan!r}, not {best.makespan!r}"
    if result.objective == "makespan-energy" and abs(score.energy - best.energy) > 1e-6 * best.energy:
        return f"energy {score.energy!r}, not {best.energy!r}"
    return None


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("--count", type=int, default=300, help="number of instances")
parser.add_argument("--first", type=int, default=0, help="number of the first instance")
parser.add_argument("--speeds", action="store_true", help="only instances with finite speeds, --count of them")
options = parser.parse_args()
wrong, seen, times = 0, [], []
drawn = (tiny_instance(seed) for seed in count(options.first))
for instance in islice((each for each in drawn if each.has_travel_time or not options.speeds), options.count):
    best = brute_force(instance)
    results = [solve(instance, method, objective=goal, time_limit_s=20) for method, goal in WAYS]
    seen.append((best.unserved > 0, instance.has_travel_time))
    times.append([result.runtime_s for result in results])
    for result in results:
        if (problem := mismatch(result, best)) is not None:
            wrong += 1
            told = f"MISMATCH {instance.name} {result.method} {result.objective}: {problem}"
            print(told, file=sys.stderr, flush=True)
infeasible, speeds = np.sum(seen, axis=0)
print(f"{options.count} instances, {infeasible} infeasible, {speeds} with finite speeds; {wrong} mismatches")
print("| method | objective | mean s | worst s |\n|---|---|---|---|")
for (method, goal), spent in zip(WAYS, np.transpose(times), strict=True):
    print(f"| {method.method.name} | {goal} | {spent.mean():.4f} | {spent.max():.3f} |")
sys.exit(int(wrong > 0))
