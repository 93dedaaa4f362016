"""A planner that re-plans as drones drop out and tasks are added, and reassigns as few drones as possible.

Run ``python examples/replan.py``.
"""

from pathlib import Path

import numpy as np

from alloc.allocators import Allocator, Result, load, reasons_of_moves, solve
from alloc.problems.formats import read_instance

EARTHQUAKES = Path(__file__).parent / "earthquakes" / "alaska.json"
BUDGET_S = 1.5
SLACK = 0.01
SHOWN = 5


class Planner:
    """Keeps a plan for the current drones and tasks.

    Parameters
    ----------
    path : Path
        The instance.
    allocator : Allocator
        Loaded once, including its policy, if any.
    """

    def __init__(self, path: Path, allocator: Allocator) -> None:
        self._allocator, self.instance = allocator, read_instance(path)
        first = solve(self.instance, allocator, time_limit_s=BUDGET_S, handle_signals=False)
        assert first.allocation is not None
        self.plan = first.allocation.to_ids(self.instance)

    def replan(self) -> Result:
        """Reassign as few drones as possible, with a makespan at most `SLACK` above the shortest one found."""
        result = solve(
            self.instance,
            self._allocator,
            objective="makespan-moves",
            makespan_slack=SLACK,
            start=self.plan,  # drones and tasks that no longer exist are dropped
            time_limit_s=BUDGET_S,
            handle_signals=False,  # left to the embedding program
        )
        assert result.allocation is not None
        self.plan = result.allocation.to_ids(self.instance)
        return result


def main() -> None:
    """Plan; re-plan after a drone drops out and a task is added, and after forty drones drop out."""
    rng = np.random.default_rng(0)
    planner = Planner(EARTHQUAKES, load("local-search"))
    print(f"{planner.instance.n} drones, {planner.instance.m} sites")
    site = planner.instance.task_position.mean(axis=0)
    busy = [name for name, task in planner.plan.items() if task is not None]
    changes = [
        ("a drone drops out, and a task is added", busy[:1], [{"id": "new", "workload": 60.0, "position": site}]),
        ("forty drones drop out", rng.choice(busy[1:], 40, replace=False).tolist(), []),
    ]
    for what, gone, added in changes:
        planner.instance = planner.instance.without_agents(gone).with_tasks(added)
        result = planner.replan()
        assert result.moves is not None
        moved, n = len(result.moves.agents), planner.instance.n
        print(f"{what}: {moved} of {n} drones move ({100 * moved / n:.1f} %), done at {result.makespan:.3f} h")
        for line in reasons_of_moves(result)[:SHOWN]:
            print(f"    {line}")


if __name__ == "__main__":
    main()
