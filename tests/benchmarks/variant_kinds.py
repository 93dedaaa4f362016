"""Gaps on instances as people have them: ranges, batteries, lists, speeds, and abilities that are no whole numbers.

    python tests/benchmarks/variant_kinds.py --methods local-search --time-limits 1,5 --seeds 10
    python tests/benchmarks/variant_kinds.py --kinds reach,battery,lists --energy --time-limits 10
    python tests/benchmarks/variant_kinds.py --methods cpsat,milp --time-limits 60 --keep    # better ones are kept

Gaps of T are against the best known makespan and against the best proven bound, both kept in `variant_kinds_best.json`
beside this file, by kind and seed; what a run meets counts as well. With `--energy` the objective has the energy as
well, and its gap is against the bound of the run at its own makespan. `instance(kind, seed)` gives the instances.
"""

import argparse
import json
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from unittest import mock

import numpy as np

from alloc.allocators import load, solve
from alloc.allocators.result import Result
from alloc.problems import Instance, machine_covering
from alloc.problems.generate import paper

BEST_KNOWN = Path(__file__).with_name("variant_kinds_best.json")

Known = dict[str, dict[str, dict[str, float]]]


def plane(
    kind: str,
    seed: int,
    agents: int,
    tasks: int,
    *,
    communication_range: tuple[float, float] | None = None,
    battery: tuple[float, float] | None = None,
    speed: tuple[float, float] | None = None,
    most_listed: int | None = None,
) -> Instance:
    """Return an instance in the unit square: abilities 1 to 10, workloads 5 to 80, each agent at a place of its own."""
    rng = np.random.default_rng([agents, tasks, seed])

    def uniform(ends: tuple[float, float] | None) -> np.ndarray | None:
        return None if ends is None else rng.uniform(*ends, agents)

    return Instance(
        name=f"{kind}-{agents}x{tasks}-seed-{seed}",
        ability=rng.integers(1, 10, agents, endpoint=True),
        workload=rng.integers(5, 80, tasks, endpoint=True),
        agent_position=rng.random((agents, 2)),
        task_position=rng.random((tasks, 2)),
        communication_range=uniform(communication_range),
        battery=uniform(battery),
        speed=uniform(speed),
        allowed_tasks=None
        if most_listed is None
        else [
            np.sort(rng.choice(tasks, size, replace=False))
            for size in rng.integers(1, most_listed, agents, endpoint=True)
        ],
    )


KINDS: dict[str, Callable[[int], Instance]] = {
    "reach": lambda seed: plane("reach", seed, 300, 40, communication_range=(0.15, 0.35)),
    "battery": lambda seed: plane("battery", seed, 300, 40, battery=(0.1, 0.4)),
    "lists": lambda seed: plane("lists", seed, 200, 40, most_listed=4),
    "speeds": lambda seed: plane("speeds", seed, 200, 30, speed=(0.5, 2.0)),
    "slow": lambda seed: plane("slow", seed, 200, 30, speed=(0.1, 0.5)),
    "real-equal": lambda seed: machine_covering(100, 40, 20, 50, seed, whole=False),
    "real": lambda seed: machine_covering(90, 30, 1, 100, seed, equal=False, whole=False),
    "paper-1": lambda seed: paper(1, seed),
    "paper-3": lambda seed: paper(3, seed),
    "covering": lambda seed: machine_covering(200, 50, 1, 1000, seed, equal=False),
    "many": lambda seed: plane("many", seed, 5000, 100),
    "few": lambda seed: plane("few", seed, 200, 5, speed=(0.5, 2.0)),
    "mixed": lambda seed: plane(
        "mixed", seed, 300, 30, communication_range=(0.3, 0.6), speed=(0.5, 2.0), battery=(0.3, 1.0), most_listed=12
    ),
}
"""Instances of each kind by seed: 300/40 by ranges or batteries; 200/40 with lists of one to four tasks; 200/30 with
speeds U(.5, 2) or U(.1, .5); real-valued abilities U(20, 50), 100/40 with equal workloads, and U(1, 100), 90/30; the
paper's scenarios 1 and 3; machine covering 200/50 with whole abilities U[1, 1000]; many agents, 5000/100, that differ
by place alone; few tasks, 200/5 with speeds; and 300/30 with ranges, batteries, speeds and lists together."""


def instance(kind: str, seed: int) -> Instance:
    """Return the instance of a kind in `KINDS`."""
    return KINDS[kind](seed)


def clock_of_limits(*, processor_time: bool) -> AbstractContextManager[object]:
    """Return a context in which time limits count the time of this process alone, for a machine with other work."""
    return mock.patch("time.monotonic", time.process_time) if processor_time else nullcontext()


def remember(known: Known, kind: str, seed: int, result: Result) -> None:
    """Keep the makespan and the bound of a result where they are better than what is known."""
    best = known.setdefault(kind, {}).setdefault(str(seed), {})
    if result.makespan is None:
        return
    best["makespan"] = min(result.makespan, best.get("makespan", np.inf))
    best["bound"] = max(result.lower_bound or 0.0, best.get("bound", 0.0))


def write(known: Known) -> None:
    """Write the best known, a line for each kind."""
    rows = [f'"{kind}": {json.dumps(dict(sorted(known[kind].items(), key=lambda row: int(row[0]))))}' for kind in known]
    BEST_KNOWN.write_text("{\n" + ",\n".join(rows) + "\n}\n")


def line(known: Known, kind: str, results: dict[int, Result]) -> str:
    """Return mean and worst gaps of one method, in per cent."""

    def column(gaps: list[float]) -> str:
        return f" {100 * np.mean(gaps):>8.3f} {100 * np.max(gaps):>7.3f}" if gaps else f" {'-':>8} {'-':>7}"

    solved = {seed: result for seed, result in results.items() if result.makespan is not None}
    best = {seed: known[kind][str(seed)] for seed in solved}
    text = column([1 - best[seed]["makespan"] / result.makespan for seed, result in solved.items()])
    text += column([1 - best[seed]["bound"] / result.makespan for seed, result in solved.items()])
    text += column([result.energy_gap for result in solved.values() if result.energy_gap is not None])
    return f"{text} {np.mean([result.runtime_s for result in results.values()]):>7.2f} {len(solved):>4}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kinds", default=",".join(KINDS), help="comma between")
    parser.add_argument("--methods", default="local-search")
    parser.add_argument("--time-limits", default="1,5", help="seconds")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--processor-time", action="store_true", help="limits count the time of this process alone")
    parser.add_argument("--energy", action="store_true", help="energy at the least makespan as second objective")
    parser.add_argument("--keep", action="store_true", help="write better makespans and bounds to the best known")
    options = parser.parse_args()
    objective = "makespan-energy" if options.energy else "makespan"
    known: Known = json.loads(BEST_KNOWN.read_text()) if BEST_KNOWN.exists() else {}
    titles = ("T / best", "worst", "T / bound", "worst", "energy", "worst")
    heads = " ".join(f"{title:>{width}}" for title, width in zip(titles, (8, 7) * 3, strict=True))
    print(f"{'kind':>10} {'method':>13} {'limit':>6} {heads} {'mean s':>7} {'runs':>4}   gaps in %")
    for kind in options.kinds.split(","):
        rows = []
        for method in options.methods.split(","):
            for limit in map(float, options.time_limits.split(",")):
                allocator = method if method == "auto" else load(method)
                results = {}
                for seed in range(options.first_seed, options.first_seed + options.seeds):
                    case = instance(kind, seed)
                    with clock_of_limits(processor_time=options.processor_time):
                        results[seed] = solve(
                            case, allocator, objective=objective, time_limit_s=limit, threads=options.threads
                        )
                    remember(known, kind, seed, results[seed])
                rows.append((method, limit, results))
        if options.keep:
            write(known)
        for method, limit, results in rows:
            print(f"{kind:>10} {method:>13} {limit:>6g}{line(known, kind, results)}", flush=True)


if __name__ == "__main__":
    main()
