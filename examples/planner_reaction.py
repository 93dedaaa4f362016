"""Measure quantiles of the time that `MissionPlanner.plan` takes after an event, with a given or a random fleet.

python examples/planner_reaction.py examples/earthquakes/alaska.json --policy greedy --events 100
python examples/planner_reaction.py --agents 500 --tasks 50 --events 10000 --policy gappo --deadline-ms 20
"""

import argparse
import gc
import time
from collections.abc import Iterator
from itertools import count

import numpy as np

from alloc.allocators import MissionPlanner
from alloc.cli.options import values
from alloc.problems import Instance, read_instance


def fleet(rng: np.random.Generator, n: int, m: int) -> Instance:
    """Return agents and tasks in a square, with sufficient batteries."""
    return Instance(
        ability=rng.uniform(1, 5, n),
        workload=rng.uniform(50, 150, m) * n / m,
        agent_position=rng.random((n, 2)),
        task_position=rng.random((m, 2)),
        speed=np.full(n, 0.5),
        battery=np.full(n, 1e6),
    )


def happening(instance: Instance, rng: np.random.Generator) -> Iterator[dict[str, object]]:
    """Yield random valid events that keep the numbers of agents and tasks roughly constant."""
    away, here, tasks = list[str](), list(instance.agent_ids), list(instance.task_ids)
    places = np.concatenate([instance.agent_position, instance.task_position])
    low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
    for number in count(1):
        kind = rng.choice(["leave", "report", "task", "change"])
        if kind == "leave" and len(away) >= 5:
            here.append(away.pop(0))
            yield {"event": "agent-returns", "agent": here[-1]}
        elif kind == "leave":
            away.append(here.pop(int(rng.integers(len(here)))))
            yield {"event": "agent-recalled", "agent": away[-1]}
        elif kind == "report":
            name = here[int(rng.integers(len(here)))]
            yield {"event": "agent-reports", "agent": name, "position": rng.uniform(low, high).tolist()}
        elif kind == "task" and len(tasks) < instance.m:
            tasks.append(f"new-{number}")
            work, place = float(rng.choice(instance.workload)), rng.uniform(low, high).tolist()
            yield {"event": "task-appears", "task": {"id": tasks[-1], "workload": work, "position": place}}
        elif kind == "task":
            yield {"event": "task-cancelled", "task": tasks.pop(int(rng.integers(len(tasks))))}
        else:
            name = tasks[int(rng.integers(len(tasks)))]
            yield {"event": "task-changes", "task": name, "workload": float(rng.choice(instance.workload))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("instance", nargs="?", help="a file with agents and tasks; random ones by default")
    for name, default in (("agents", 500), ("tasks", 50), ("events", 1000), ("seed", 0)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--deadline-ms", type=float, default=100.0)
    parser.add_argument("--pause-ms", type=float, default=0.0, help="sleep between a plan and the next event")
    parser.add_argument("--policy", default="replan")
    parser.add_argument("--set", metavar="NAME=VALUE", action="append", help="a parameter of the policy")
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    instance = read_instance(given.instance) if given.instance else fleet(rng, given.agents, given.tasks)
    plans, submits, busy, old, changed = list[float](), list[float](), list[float](), 0, 0
    with MissionPlanner(instance, given.policy, given.deadline_ms, **values(given.set)) as station:
        first = time.perf_counter()
        station.plan()
        print(f"first plan: ms {1000 * (time.perf_counter() - first):.1f}")
        gc.collect()
        gc.freeze()  # as the guide advises
        for number, event in zip(range(given.events), happening(instance, rng), strict=False):
            time.sleep(given.pause_ms / 1000)
            began = time.perf_counter()
            station.submit({**event, "hour": 0.001 * (number + 1)})
            told, used = time.perf_counter(), time.process_time()
            plan = station.plan()
            busy.append(1000 * (time.process_time() - used))
            plans.append(1000 * (time.perf_counter() - told))
            submits.append(1000 * (told - began))
            old += not plan.is_new
            changed += len(plan.changes)
            assert plan.problem is None, plan.problem
    for name, times in (("submit", submits), ("plan", plans), ("plan, processor time", busy)):
        quantiles = ", ".join(f"{one:.1f}" for one in np.percentile(times, [50, 90, 99, 99.9, 100]))
        print(f"{name}: ms at 50, 90, 99, 99.9, 100 %: {quantiles}")
    late = sum(value > given.deadline_ms for value in plans)
    print(f"past the deadline: {late} of {given.events}; previous plan kept: {old}; changes: {changed}")


if __name__ == "__main__":
    main()
