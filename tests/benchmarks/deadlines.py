"""By how much deadlines are missed: time limits of methods, plans of `MissionPlanner`, answers of `alloc serve`.

    python tests/benchmarks/deadlines.py limits --calls 1000
    python tests/benchmarks/deadlines.py planner --events 10000 --policy gappo --deadline-ms 20
    python tests/benchmarks/deadlines.py service --seconds 60

`limits`: p50, p99 and worst of the milliseconds beyond short limits of each anytime method, from the call of `solve` to
its result, with the bounds that follow the run. With `--processor` all clocks of the process, that of the budgets too,
count its processor time, of which others on a busy machine take none: a run in one thread hardly waits. Native solvers
keep to the wall clock, but are stopped by ours.

`planner`: how long `plan` takes after an event.

`service`: 20 clients with deadlines of 50 ms, 5 % of whose requests are malformed, too large, or given up after 10 ms:
times to answer, the excess over 50 ms + 15 ms for each request ahead, the processor time of an answer, and the memory
of the server. On a busy machine look at the processor time: below 15 ms, a server with a processor of its own keeps to
what is promised.
"""

import argparse
import asyncio
import gc
import json
import os
import random
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import count
from pathlib import Path

import httpx
import numpy as np

from alloc.allocators import Allocator, MissionPlanner, RefusedError, describe, load, names, solve
from alloc.allocators.experiments.isolation.tree import resident_mb
from alloc.cli.options import values
from alloc.problems import Instance
from alloc.problems.formats import to_document
from alloc.problems.generate import paper, paper_like

GOAL = "makespan-energy"
"""With energy no method is done at once."""

SIZES = {"30/8": paper_like(30, 8, 120, seed=1), "100/20": paper(1, seed=1), "500/50": paper(4, seed=1)}
LIMITS_MS = (20, 50, 100)

SERVED = ("gappo", "local-search", "greedy")
DEADLINE_MS, PER_REQUEST_MS, BAD_SHARE, OVERSIZED = 50.0, 15.0, 0.05, 5_000_000


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


def service(given: argparse.Namespace) -> None:
    """Start a server, and ask it as many clients do."""
    command = [sys.executable, "-m", "alloc", "serve", "--http", "0", "--load", ",".join(SERVED)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        address = server.stderr.readline().split()[-1]
        threading.Thread(target=sys.stderr.writelines, args=(server.stderr,)).start()
        asyncio.run(ask(address, server.pid, given))
        server.terminate()
        print("exit code of the server:", server.wait(30))


async def ask(address: str, process: int, given: argparse.Namespace) -> None:
    """Let all clients ask, and print how they were answered."""
    rng = random.Random(0)
    instances = [to_document(paper(1, seed=seed)) for seed in range(10)]
    common = {"limit_ms": DEADLINE_MS, "objective": given.objective}
    bodies = [
        json.dumps({"instance": rng.choice(instances), "method": rng.choice(SERVED), "seed": number, **common})
        for number in range(50)
    ]
    counts, times = Counter[str](), list[tuple[float, int]]()
    until, spent_s, memory = time.monotonic() + given.seconds, processor_s(process), [resident_mb([process])]
    waiting = asyncio.gather(*(client(one, address, bodies, until, counts, times) for one in range(given.clients)))
    while not waiting.done():
        await asyncio.wait([waiting], timeout=given.seconds / 10)
        memory.append(resident_mb([process]))
    spent_ms = 1000 * (processor_s(process) - spent_s) / len(times)
    taken, ahead = np.array(times).T
    excess = taken - DEADLINE_MS - PER_REQUEST_MS * ahead
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; requests:", dict(counts))
    print(f"{len(times) / given.seconds:.0f} answers a second, processor time {spent_ms:.1f} ms each")
    print(f"ms to answer at 50, 90, 99, 99.9, 100 %: {quantiles(taken)}")
    print(f"ahead: mean {ahead.mean():.1f}, most {ahead.max():.0f}; promised are {50 + 15 * ahead.mean():.0f} ms")
    print(f"beyond 50 ms + 15 ms for each ahead: {(excess > 0).mean():.2%}, p99 by {np.percentile(excess, 99):.0f} ms")
    print("memory of the server, MB:", *(f"{one:.0f}" for one in memory))


async def client(
    number: int, address: str, bodies: Sequence[str], until: float, counts: Counter[str], times: list[tuple[float, int]]
) -> None:
    """Ask until the time is over; count all answers, and time the good ones, with how many were ahead."""
    rng = random.Random(number)
    async with httpx.AsyncClient(base_url=address, timeout=30) as session:
        while time.monotonic() < until:
            content, kind = rng.choice(bodies), "good"
            if rng.random() < BAD_SHARE:
                kind = rng.choice(["malformed", "oversized", "given up"])
                content = {"malformed": content[:-9], "oversized": content + " " * OVERSIZED}.get(kind, content)
            begin = time.monotonic()
            try:
                answer = await session.post("/solve", content=content, timeout=0.01 if kind == "given up" else 30)
            except httpx.TransportError as error:
                counts[f"{kind}: {type(error).__name__}"] += 1
                continue
            counts[f"{kind}: {answer.status_code}"] += 1
            if kind == "good" and answer.status_code == 200:
                times.append((1000 * (time.monotonic() - begin), answer.json()["ahead"]))


def processor_s(process: int) -> float:
    """Return the seconds of a processor that a process has had."""
    user, system = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


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
    one = commands.add_parser("service")
    one.add_argument("--seconds", type=float, default=60)
    one.add_argument("--clients", type=int, default=20)
    one.add_argument("--objective", default=GOAL)
    one.set_defaults(command=service)
    given = parser.parse_args()
    given.command(given)


if __name__ == "__main__":
    main()
