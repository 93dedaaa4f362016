"""A ground station with `MissionPlanner`: telemetry in, orders out, with a failing agent and a new task.

Run ``python examples/ground_station.py``.
"""

import math

from alloc.allocators import MissionPlanner
from alloc.problems import Instance

STEP_H = 0.25
WIND = 0.8
"""Factor on the speed of the drones, which the planner does not know but corrects from their reports."""

FLEET = Instance(
    agent_ids=["d1", "d2", "d3", "d4"],
    ability=[2, 2, 3, 3],
    agent_position=[[0, 0], [0, 0], [4, 4], [4, 4]],
    speed=[2, 2, 2, 2],
    battery=[40, 40, 40, 40],
    task_ids=["north", "east", "west"],
    workload=[6, 4, 5],
    task_position=[[2, 5], [5, 1], [0, 3]],
)


class Drones:
    """Simulated drones: they fly and work as ordered, and report."""

    def __init__(self) -> None:
        self.place = dict(zip(FLEET.agent_ids, FLEET.agent_position[:, :2].tolist(), strict=True))
        self.site = dict(zip(FLEET.task_ids, FLEET.task_position[:, :2].tolist(), strict=True))
        self.left = dict(zip(FLEET.task_ids, FLEET.workload.tolist(), strict=True))

    def step(self, orders):
        """Let the drones follow their orders for a time step; return their telemetry."""
        for name, order in orders.items():
            if order.task is None:
                continue
            (x, y), (a, b) = self.place[name], self.site[order.task]
            away = math.hypot(a - x, b - y)
            share = min(1, WIND * 2 * STEP_H / away) if away else 1
            self.place[name] = [x + share * (a - x), y + share * (b - y)]
            if away == 0:
                self.left[order.task] = max(0, self.left[order.task] - 2 * STEP_H)
        for name in orders:
            yield {"event": "agent-reports", "agent": name, "position": self.place[name]}
        for task, left in self.left.items():
            yield {"event": "task-changes", "task": task, "workload": left}


def main() -> None:
    """Run the station until all tasks are done."""
    drones = Drones()
    with MissionPlanner(FLEET, "routes", deadline_ms=1000) as planner:
        hour, orders = 0.0, planner.plan()
        while any(drones.left.values()):
            for change in planner.why_changed() if orders.hour == hour else ():
                print(f"{hour:5.2f} h  {change.agent}: {change.after and change.after.task}  ({change.cause})")
            hour += STEP_H
            for event in drones.step(orders):
                planner.submit({"hour": hour, **event})
            if hour == 1.0:
                planner.submit({"event": "agent-fails", "agent": "d3"})
            if hour == 1.5:
                drones.site["south"], drones.left["south"] = [3, 0], 4
                planner.submit(
                    {"event": "task-appears", "task": {"id": "south", "workload": 4, "position": [3, 0], "priority": 5}}
                )
            orders = planner.plan()
        print(f"{hour:5.2f} h  all is done")


if __name__ == "__main__":
    main()
