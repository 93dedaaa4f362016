"""Exact methods against brute force on random tiny instances: prints a table, exits with 1 on any mismatch.

python tests/benchmarks/exact_vs_brute_force.py --count 300
"""

import argparse
import sys
import time
from itertools import count, islice
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from oracle import Optimum, brute_force
from tiny_instances import tiny_instance

from alloc.allocators import Result, load, solve

METHODS = ("cpsat", "milp")
OBJECTIVES = ("makespan", "makespan-energy")


def mismatch(result: Result, best: Optimum) -> str | None:
    """Return in what `result` differs from the optimum, or None."""
    score = result.evaluation
    if score is None or score.violations:
        return "no plan, or one that breaks a rule"
    expected = "infeasible" if best.unserved else "optimal"
    if str(result.status) != expected:
        return f"status {result.status}, not {expected}"
    if len(score.unserved_tasks) != best.unserved:
        return f"{len(score.unserved_tasks)} tasks unserved, not {best.unserved}"
    if abs(score.served_makespan - best.makespan) > 1e-6 * best.makespan:
        return f"makespan {score.served_makespan!r}, not {best.makespan!r}"
    if result.objective == "makespan-energy" and abs(score.energy - best.energy) > 1e-6 * best.energy:
        return f"energy {score.energy!r}, not {best.energy!r}"
    return None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300, help="number of instances")
    parser.add_argument("--first", type=int, default=0, help="number of the first instance")
    parser.add_argument("--speeds", action="store_true", help="only instances with finite speeds, --count of them")
    options = parser.parse_args()
    loaded = {method: load(method) for method in METHODS}
    seconds = {(method, goal): [0.0, 0.0] for method in METHODS for goal in OBJECTIVES}
    wrong = infeasible = speeds = 0
    drawn = (tiny_instance(seed) for seed in count(options.first))
    for instance in islice((each for each in drawn if each.has_travel_time or not options.speeds), options.count):
        best = brute_force(instance)
        infeasible += best.unserved > 0
        speeds += instance.has_travel_time
        for (method, goal), spent in seconds.items():
            begin = time.monotonic()
            result = solve(instance, loaded[method], objective=goal, time_limit_s=20)
            spent[:] = spent[0] + time.monotonic() - begin, max(spent[1], time.monotonic() - begin)
            if (problem := mismatch(result, best)) is not None:
                wrong += 1
                print(f"MISMATCH {instance.name} {method} {goal}: {problem}", file=sys.stderr, flush=True)
    print(f"{options.count} instances, {infeasible} infeasible, {speeds} with finite speeds; {wrong} mismatches")
    print("| method | objective | mean s | worst s |\n|---|---|---|---|")
    for (method, goal), (total, worst) in seconds.items():
        print(f"| {method} | {goal} | {total / options.count:.4f} | {worst:.3f} |")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
