"""A planner that re-plans as drones drop out and tasks come in, and leaves as many drones as it can where they are.

Run ``python examples/replan.py``.
"""

from pathlib import Path

import numpy as np

from alloc.allocators import Allocator, Result, load, reasons_of_moves, solve
from alloc.problems.formats import read_instance

EARTHQUAKES = Path(__file__).parent / "earthquakes" / "alaska.json"
BUDGET_S = 4.0
SLACK = 0.01
SHOWN = 5


class Planner:
    """Keeps a plan for the drones and the tasks that there are.

    Parameters
    ----------
    path : Path
        The instance.
    allocator : Allocator
        Loaded once; a policy would be read once.
    """

    def __init__(self, path: Path, allocator: Allocator) -> None:
        self._allocator, self.instance = allocator, read_instance(path)
        first = solve(self.instance, allocator, time_limit_s=BUDGET_S, handle_signals=False)
        assert first.allocation is not None
        self.plan = first.allocation.to_ids(self.instance)

    def replan(self) -> Result:
        """Move as few drones as possible, so that all is done at most `SLACK` later than it could be."""
        result = solve(
            self.instance,
            self._allocator,
            objective="makespan-moves",
            makespan_slack=SLACK,
            start=self.plan,  # drones and tasks that have gone since are left out
            time_limit_s=BUDGET_S,
            handle_signals=False,  # the program that embeds this has its own
        )
        assert result.allocation is not None
        self.plan = result.allocation.to_ids(self.instance)
        return result


def main() -> None:
    """Plan; then a drone drops out and a task comes in, and forty drones drop out."""
    rng = np.random.default_rng(0)
    planner = Planner(EARTHQUAKES, load("cpsat"))
    print(f"{planner.instance.n} drones, {planner.instance.m} sites")
    site = planner.instance.task_position.mean(axis=0)
    busy = [name for name, task in planner.plan.items() if task is not None]
    changes = [
        ("a drone drops out, and a task comes in", busy[:1], [{"id": "new", "workload": 500.0, "position": site}]),
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
