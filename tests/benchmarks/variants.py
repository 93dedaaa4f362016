"""Every method on random tiny instances with metrics, own distances, rates, returns, skills, speeds and limits.

    python tests/benchmarks/variants.py [--instances 300] [--methods cpsat,milp,greedy,...]

Each field alone on the first instances, then any of them together. Against brute force: exact methods must find the
optimum of both objectives, and the others must serve as many tasks, send nobody astray, and beat no optimum.
"""

import argparse
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from oracle import Optimum, brute_force
from tiny_instances import FIELDS, varied_instance

from alloc.allocators import load, solve
from alloc.allocators.registry import BUILT_IN
from alloc.problems import Evaluation, Instance
from alloc.problems.vocabulary import OBJECTIVES, Objective

ALONE = 10
"""Instances of each field by itself."""


def instances(count: int) -> list[Instance]:
    """Return the instances: `ALONE` of each field by itself, the rest with any of them."""
    alone = [varied_instance(seed, {name}) for name in FIELDS for seed in range(ALONE)]
    return [*alone, *(varied_instance(seed) for seed in range(count - len(alone)))][:count]


def fault(score: Evaluation, best: Optimum, objective: Objective, *, exact: bool) -> str | None:
    """Return what is wrong with an answer, None if nothing is."""
    if score.violations:
        return "sends an agent astray"
    if len(score.unserved_tasks) != best.unserved:
        return "serves another number of tasks"
    if score.served_makespan < best.makespan * (1 - 1e-9):
        return "is faster than can be"
    as_fast = score.served_makespan <= best.makespan * (1 + 1e-9)
    if as_fast and score.energy < best.energy * (1 - 1e-9) - 1e-9:
        return "takes less energy than can be"
    if exact and score.served_makespan > best.makespan * (1 + 1e-6):
        return "is slower than the optimum"
    equal = math.isclose(score.energy, best.energy, rel_tol=1e-6, abs_tol=1e-9)
    if exact and objective is Objective.MAKESPAN_ENERGY and not equal:
        return "takes more energy than the optimum"
    return None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--instances", type=int, default=300)
    parser.add_argument("--methods", default=",".join(BUILT_IN))
    options = parser.parse_args()
    problems = [(instance, brute_force(instance)) for instance in instances(options.instances)]
    print("| method | runs | refused | faults |\n|---|--:|--:|--:|")
    for name in options.methods.split(","):
        allocator, exact = load(name), BUILT_IN[name].kind == "exact"
        runs, refused, faults = 0, 0, []
        for instance, best in problems:
            if instance.has_travel_time and not BUILT_IN[name].finite_speeds:
                refused += 1
                continue
            for objective in OBJECTIVES:
                iterations = None if exact else 20
                result = solve(instance, allocator, objective=objective, time_limit_s=None, iterations=iterations)
                assert result.evaluation is not None
                wrong = fault(result.evaluation, best, objective, exact=exact)
                runs += 1
                faults += [f"{instance.name} {objective}: {wrong}"] if wrong else []
        print(f"| {name} | {runs} | {refused} | {len(faults)} |", *faults[:5], flush=True)


if __name__ == "__main__":
    main()
