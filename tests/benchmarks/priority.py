"""Every method on random tiny instances with too few agents: are the most urgent tasks served? Brute force says.

python tests/benchmarks/priority.py [--instances 1000] [--methods greedy,ga]
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from oracle import brute_force
from tiny_instances import scarce_instance

from alloc.allocators import load, solve
from alloc.allocators.registry import BUILT_IN

METHODS = "auto,greedy,local-search,lp-round,hedonic,auction,ga,cpsat,milp,gappo,gappo-ls"


def main() -> None:
    """Print a line for each method: instances, those with too many unserved tasks, and those with too urgent ones."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--instances", type=int, default=1000)
    parser.add_argument("--methods", default=METHODS)
    arguments = parser.parse_args()
    cases = [scarce_instance(seed) for seed in range(arguments.instances)]
    optima = [brute_force(instance) for instance in cases]
    for name in arguments.methods.split(","):
        allocator = "auto" if name == "auto" else load(name)
        solved = too_many = too_urgent = 0
        begin = time.monotonic()
        for instance, best in zip(cases, optima, strict=True):
            if instance.has_travel_time and name != "auto" and not BUILT_IN[name].finite_speeds:
                continue
            score = solve(instance, allocator, time_limit_s=None, iterations=3).evaluation
            solved += 1
            too_many += len(score.unserved_tasks) > best.unserved
            too_urgent += sum(score.unserved_priorities) > best.lost + 1e-9
        seconds = time.monotonic() - begin
        print(f"{name:12} {solved:5} instances, {too_many} serve too few, {too_urgent} less priority, {seconds:.0f} s")


if __name__ == "__main__":
    main()
