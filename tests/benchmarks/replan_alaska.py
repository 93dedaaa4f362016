"""How many of Alaska's 384 drones move when one drops out and a task comes in, at 1 % slack, with the bound beside it.

    python tests/benchmarks/replan_alaska.py [--methods cpsat,local-search,gappo] [--time-limit 10]

The plan in force is the best of `cpsat` in 15 s. The new task lies amid the others; its workload is the least, the 10th
percentile and the median of theirs.
"""

import argparse
from pathlib import Path

import numpy as np

from alloc.allocators import solve
from alloc.problems import read_instance

ALASKA = Path(__file__).parents[2] / "examples" / "earthquakes" / "alaska.json"
SLACK = 0.01


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default="cpsat,local-search,gappo")
    parser.add_argument("--time-limit", type=float, default=10.0)
    options = parser.parse_args()
    before = read_instance(ALASKA)
    first = solve(before, "cpsat", time_limit_s=15)
    assert first.allocation is not None
    plan = first.allocation.to_ids(before)
    gone = next(name for name, task in plan.items() if task is not None)
    print(f"plan in force: {first.makespan:.4f} h, at least {first.lower_bound:.4f} h")
    print("| new task | method | makespan | at least | moved of 383 | at least |")
    print("|--:|---|--:|--:|--:|--:|")
    for workload in np.percentile(before.workload, [0, 10, 50]):
        task = {"id": "new", "workload": workload, "position": before.task_position.mean(axis=0)}
        now = before.without_agents([gone]).with_tasks([task])
        for method in options.methods.split(","):
            result = solve(
                now,
                method,
                objective="makespan-moves",
                makespan_slack=SLACK,
                start=plan,
                time_limit_s=options.time_limit,
            )
            moves = result.moves
            assert moves is not None
            bound = moves.cost_lower_bound or 0.0
            moved, percent = len(moves.agents), 100 * len(moves.agents) / now.n
            print(
                f"| {workload:.1f} | {method} | {result.makespan:.4f} | {result.lower_bound:.4f} "
                f"| {moved} ({percent:.1f} %) | {np.ceil(bound - 1e-6):.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
