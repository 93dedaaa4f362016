"""How long `MissionPlanner.plan` takes after an event: quantiles, and how often it was past its deadline.

Run ``python tests/benchmarks/planner_reaction.py --events 10000``.
"""

import argparse
import gc
import time

import numpy as np

from alloc.allocators import MissionPlanner
from alloc.cli.options import values
from alloc.problems import Instance


def mission(rng: np.random.Generator, agents: int, tasks: int) -> Instance:
    """Return agents and tasks in a square, with batteries that are enough."""
    return Instance(
        ability=rng.uniform(1, 5, agents),
        workload=rng.uniform(50, 150, tasks) * agents / tasks,
        agent_position=rng.random((agents, 2)),
        task_position=rng.random((tasks, 2)),
        speed=np.full(agents, 0.5),
        battery=np.full(agents, 1e6),
    )


class Events:
    """Draws events that can happen, so that about as many agents and tasks are there as at the beginning."""

    def __init__(self, instance: Instance, rng: np.random.Generator) -> None:
        self._rng, self._instance = rng, instance
        self._away: list[str] = []
        self._here = list(instance.agent_ids)
        self._tasks = list(instance.task_ids)
        self._count = 0

    def draw(self) -> dict[str, object]:
        """Return the next event."""
        self._count += 1
        rng = self._rng
        kind = rng.choice(["leave", "report", "task", "change"])
        if kind == "leave":
            if len(self._away) >= 5:
                name = self._away.pop(0)
                self._here.append(name)
                return {"event": "agent-returns", "agent": name}
            name = self._here.pop(int(rng.integers(len(self._here))))
            self._away.append(name)
            return {"event": "agent-recalled", "agent": name}
        if kind == "report":
            name = self._here[int(rng.integers(len(self._here)))]
            return {"event": "agent-reports", "agent": name, "position": rng.random(2).tolist()}
        if kind == "task" and len(self._tasks) < self._instance.m:
            name = f"new-{self._count}"
            self._tasks.append(name)
            workload = float(rng.choice(self._instance.workload))
            return {
                "event": "task-appears",
                "task": {"id": name, "workload": workload, "position": rng.random(2).tolist()},
            }
        if kind == "task":
            return {"event": "task-cancelled", "task": self._tasks.pop(int(rng.integers(len(self._tasks))))}
        name = self._tasks[int(rng.integers(len(self._tasks)))]
        return {"event": "task-changes", "task": name, "workload": float(rng.choice(self._instance.workload))}


def main() -> None:
    """Submit events, and time each plan."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("agents", 500), ("tasks", 50), ("events", 1000), ("seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--deadline-ms", type=float, default=100.0)
    parser.add_argument("--pause-ms", type=float, default=0.0, help="Sleep between a plan and the next event.")
    parser.add_argument("--policy", default="replan")
    parser.add_argument("--set", metavar="NAME=VALUE", action="append", help="A parameter of the policy.")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    instance = mission(rng, given.agents, given.tasks)
    events = Events(instance, rng)
    plans, submits, busy, old, changed = [], [], [], 0, 0
    with MissionPlanner(instance, given.policy, given.deadline_ms, **values(given.set)) as planner:
        first = time.perf_counter()
        planner.plan()
        print(f"first plan: ms {1000 * (time.perf_counter() - first):.1f}")
        gc.collect()
        gc.freeze()  # as the guide advises
        for number in range(given.events):
            event = events.draw()
            time.sleep(given.pause_ms / 1000)
            began = time.perf_counter()
            planner.submit({**event, "hour": 0.001 * (number + 1)})
            told, used = time.perf_counter(), time.process_time()
            plan = planner.plan()
            busy.append(1000 * (time.process_time() - used))
            plans.append(1000 * (time.perf_counter() - told))
            submits.append(1000 * (told - began))
            old += not plan.is_new
            changed += len(plan.changes)
            assert plan.problem is None, plan.problem
    for name, times in (("submit", submits), ("plan", plans), ("plan, time of processors", busy)):
        quantiles = " ".join(f"{np.quantile(times, share):.1f}" for share in (0.5, 0.9, 0.99, 0.999, 1))
        print(f"{name}: ms at 50, 90, 99, 99.9, 100 %: {quantiles}")
    late = sum(value > given.deadline_ms for value in plans)
    print(f"past the deadline: {late} of {given.events}; last plan instead of a new one: {old}; changes {changed}")


if __name__ == "__main__":
    main()
