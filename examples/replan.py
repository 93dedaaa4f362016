"""A planner that re-plans as agents drop out: one allocator for all plans, each begun from the last.

Run ``python examples/replan.py``.
"""

from pathlib import Path

import numpy as np

from alloc.allocators import Allocator, Improvement, Result, load, solve
from alloc.problems import Allocation, Instance
from alloc.problems.formats import read_instance

EARTHQUAKES = Path(__file__).parent / "earthquakes" / "alaska.json"
BUDGET_S = 0.5


class Planner:
    """Keeps a plan for the agents that are left.

    Parameters
    ----------
    instance : Instance
        All agents and tasks.
    allocator : Allocator
        Loaded once; a policy would be read once.
    """

    def __init__(self, instance: Instance, allocator: Allocator) -> None:
        self._allocator = allocator
        self.instance, self.plan = instance, Allocation.idle(instance)

    def replan(self) -> Result:
        """Improve the plan for `BUDGET_S` seconds, telling of each improvement."""
        result = solve(
            self.instance,
            self._allocator,
            time_limit_s=BUDGET_S,
            start=self.plan,
            on_improvement=self._tell,
            handle_signals=False,  # the program that embeds this has its own
        )
        assert result.allocation is not None
        self.plan = result.allocation
        return result

    def drop(self, agents: set[str]) -> None:
        """Take agents away; the others keep their tasks until the next `replan`."""
        plan = self.plan.to_ids(self.instance)
        self.instance = self.instance.without_agents(agents)
        self.plan = Allocation.from_ids(self.instance, {name: plan[name] for name in self.instance.agent_ids})

    @staticmethod
    def _tell(improvement: Improvement) -> None:
        score = improvement.evaluation
        print(f"    {improvement.time_s:5.2f} s  {score.served_makespan:.4f} h, {len(score.unserved_tasks)} unserved")


def main() -> None:
    """Plan, lose forty drones, plan again; twice."""
    rng = np.random.default_rng(0)
    planner = Planner(read_instance(EARTHQUAKES), load("ga"))
    print(f"{planner.instance.n} drones, {planner.instance.m} sites")
    result = planner.replan()
    for _ in range(2):
        before = planner.plan.to_ids(planner.instance)
        lost = set(rng.choice(planner.instance.agent_ids, 40, replace=False).tolist())
        planner.drop(lost)
        print(f"{len(lost)} drones drop out, {sum(before[name] is not None for name in lost)} of them at work")
        result = planner.replan()
        after = planner.plan.to_ids(planner.instance)
        moved = sum(task != before[name] for name, task in after.items())
        print(f"  {moved} of {len(after)} drones get another task; done in {result.makespan:.3f} h, {result.status}")


if __name__ == "__main__":
    main()
