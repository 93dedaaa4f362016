"""By how much deadlines are missed: time limits of methods, and plans of `MissionPlanner`.

    python tests/benchmarks/deadlines.py limits --calls 1000
    python tests/benchmarks/deadlines.py planner --events 10000 --policy gappo --deadline-ms 20

`limits`: p50, p99 and worst of the milliseconds beyond short limits of each anytime method, from the call of `solve` to
its result, with the bounds that follow the run. With `--processor` all clocks of the process, that of the budgets too,
count its processor time, of which others on a busy machine take none: a run in one thread hardly waits. Native solvers
keep to the wall clock, but are stopped by ours.

`planner`: how long `plan` takes after an event.
"""

import argparse
import gc
import os
import time
from collections.abc import Iterator, Sequence
from itertools import count

import numpy as np

from alloc.allocators import Allocator, MissionPlanner, RefusedError, describe, load, names, solve
from alloc.cli.options import values
from alloc.problems import Instance
from alloc.problems.generate import paper, paper_like

GOAL = "makespan-energy"
"""With energy no method is done at once."""

SIZES = {"30/8": paper_like(30, 8, 120, seed=1), "100/20": paper(1, seed=1), "500/50": paper(4, seed=1)}
LIMITS_MS = (20, 50, 100)


def quantiles(times_ms: Sequence[float], at: Sequence[float] = (50, 90, 99, 99.9, 100)) -> str:
    """Return quantiles, at percentages."""
    return ", ".join(f"{one:.1f}" for one in np.percentile(times_ms, at))


def limits(given: argparse.Namespace) -> None:
    """Print a row for each method and size."""
    if given.processor:
        time.monotonic = time.process_time
    print(f"{given.calls} calls each, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    print("| method | size | " + " | ".join(f"{limit} ms: p50, p99, worst" for limit in LIMITS_MS) + " |")
    print("|---" * (2 + len(LIMITS_MS)) + "|")
    gc.freeze()
    for name, (size, instance) in ((name, one) for name in given.methods for one in SIZES.items()):
        method = load(name)
        cells = [overshoot(instance, method, limit, given.calls) for limit in LIMITS_MS]
        print(f"| {name} | {size} | {' | '.join(cells)} |", flush=True)


def overshoot(instance: Instance, method: Allocator, limit_ms: float, calls: int) -> str:
    """Return p50, p99 and worst of the milliseconds beyond the limit."""
    times = []
    for seed in range(-2, calls):  # the first two are in vain
        begin = time.monotonic()
        try:
            solve(instance, method, objective=GOAL, time_limit_s=limit_ms / 1000, seed=abs(seed), threads=1)
        except RefusedError:
            return "refused"
        times.append(1000 * (time.monotonic() - begin) - limit_ms)
    return quantiles(times[2:], (50, 99, 100))


def planner(given: argparse.Namespace) -> None:
    """Submit events, and time each plan."""
    rng, n, m = np.random.default_rng(given.seed), given.agents, given.tasks
    instance = Instance(
        ability=rng.uniform(1, 5, n),
        workload=rng.uniform(50, 150, m) * n / m,
        agent_position=rng.random((n, 2)),
        task_position=rng.random((m, 2)),
        speed=np.full(n, 0.5),
        battery=np.full(n, 1e6),
    )
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
    for name, times in (("submit", submits), ("plan", plans), ("plan, time of processors", busy)):
        print(f"{name}: ms at 50, 90, 99, 99.9, 100 %: {quantiles(times)}")
    late = sum(value > given.deadline_ms for value in plans)
    print(f"past the deadline: {late} of {given.events}; last plan instead of a new one: {old}; changes {changed}")


def happening(instance: Instance, rng: np.random.Generator) -> Iterator[dict[str, object]]:
    """Yield events that can happen, so that about as many agents and tasks are there as at the beginning."""
    away, here, tasks = list[str](), list(instance.agent_ids), list(instance.task_ids)
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
            yield {"event": "agent-reports", "agent": name, "position": rng.random(2).tolist()}
        elif kind == "task" and len(tasks) < instance.m:
            tasks.append(f"new-{number}")
            work, place = float(rng.choice(instance.workload)), rng.random(2).tolist()
            yield {"event": "task-appears", "task": {"id": tasks[-1], "workload": work, "position": place}}
        elif kind == "task":
            yield {"event": "task-cancelled", "task": tasks.pop(int(rng.integers(len(tasks))))}
        else:
            name = tasks[int(rng.integers(len(tasks)))]
            yield {"event": "task-changes", "task": name, "workload": float(rng.choice(instance.workload))}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    one = commands.add_parser("limits")
    one.add_argument("--calls", type=int, default=1000)
    one.add_argument("--methods", nargs="+", default=[name for name in names() if describe(name).anytime])
    one.add_argument("--processor", action="store_true", help="processor time")
    one.set_defaults(command=limits)
    one = commands.add_parser("planner")
    for name, default in (("agents", 500), ("tasks", 50), ("events", 1000), ("seed", 0)):
        one.add_argument(f"--{name}", type=int, default=default)
    one.add_argument("--deadline-ms", type=float, default=100.0)
    one.add_argument("--pause-ms", type=float, default=0.0, help="sleep between a plan and the next event")
    one.add_argument("--policy", default="replan")
    one.add_argument("--set", metavar="NAME=VALUE", action="append", help="a parameter of the policy")
    one.set_defaults(command=planner)
    given = parser.parse_args()
    given.command(given)


if __name__ == "__main__":
    main()
