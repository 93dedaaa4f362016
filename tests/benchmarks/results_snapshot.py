"""Results of every method on 200 instances of all kinds, by iterations and seed, to compare two versions to the bit.

python tests/benchmarks/results_snapshot.py run before.jsonl      # in a checkout of the one version
python tests/benchmarks/results_snapshot.py run after.jsonl       # in a checkout of the other
python tests/benchmarks/results_snapshot.py compare before.jsonl after.jsonl
"""

import argparse
import hashlib
import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from alloc.allocators import RefusedError, load, names, solve
from alloc.problems import Family, Instance, paper_like, random_instance

ITERATIONS = {"ga": 10, "hedonic": 40, "auction": 200}
"""Of each method that is not run for `FEW_ITERATIONS`; the exact ones end when they have proven an optimum."""

FEW_ITERATIONS = 4
OBJECTIVES = ("makespan", "makespan-energy")
SMALL = 12
"""Agents below which the exact methods run whatever the kind; beyond, for the makespan of whole abilities alone."""


def tiny(seed: int) -> Instance:
    """Return an instance of up to 6 agents with places, ranges, batteries, lists or speeds, each by chance."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 7)), int(rng.integers(1, 5))

    def maybe(values: np.ndarray) -> np.ndarray | None:
        return values if rng.random() < 0.5 else None

    whole = rng.random() < 0.5
    lists = [None if rng.random() < 0.5 else np.flatnonzero(rng.random(m) < 0.6).tolist() for _ in range(n)]
    return Instance(
        ability=rng.integers(1, 7, n) if whole else rng.uniform(0.25, 8, n),
        workload=rng.integers(0, 13, m) if whole else rng.uniform(0.25, 12, m),
        agent_position=maybe(rng.choice([0.0, 0.5, 1.0, 2.0], (n, 3))),
        task_position=rng.choice([0.0, 0.5, 1.0, 2.0], (m, 3)),
        start_task=rng.integers(-1, m, n),
        battery=maybe(rng.choice([0.5, 1.0, 2.5, np.inf], n)),
        communication_range=maybe(rng.choice([0.5, 1.0, 2.5, np.inf], n)),
        speed=maybe(rng.choice([0.25, 1.0, 3.0, np.inf], n)),
        allowed_tasks=lists if rng.random() < 0.3 else None,
        energy_per_distance=float(rng.choice([0.0, 1.0, 6.0])),
        name=f"tiny-{seed}",
    )


KINDS: dict[str, dict[str, object]] = {
    "plain": {},
    "own": {"starts": "own", "sites": "clustered"},
    "real": {"integer": False},
    "lognormal": {"ability": "lognormal", "ability_max": 100.0, "workload": "lognormal", "integer": False},
    "pareto": {"ability": "pareto", "integer": False},
    "battery": {"battery": (1.0, 4.0), "starts": "own"},
    "ranges": {"communication_range": 0.4, "starts": "own", "dimensions": 2},
    "slow": {"speed": (0.1, 0.5), "starts": "own"},
    "fast": {"speed": (2.0, 8.0), "starts": "own"},
    "crowded": {"agents": 12, "tasks": 20},
}


def instances() -> Iterator[Instance]:
    """Yield 120 tiny instances, 60 of ten families, and 20 like the paper's."""
    yield from map(tiny, range(120))
    for kind, options in KINDS.items():
        for seed in range(6):
            sizes = {"agents": (24, 40, 80)[seed % 3], "tasks": (6, 9, 16)[seed % 3], "battery": 30.0}
            yield random_instance(Family(**{**sizes, **options}), seed, name=f"{kind}-{seed}")  # type: ignore[arg-type]
    for seed in range(20):
        yield paper_like(100, 20, 400, seed, name=f"paper-{seed}")


def key(value: float | None) -> str | None:
    """Return a float in full."""
    return None if value is None else float(value).hex()


def run(path: Path) -> None:
    """Write one line for each instance, method and objective; goes on where a file ends."""
    done = {(row["instance"], row["method"], row["objective"]) for row in rows(path)} if path.exists() else set()
    loaded = {name: load(name) for name in names()}
    with path.open("a") as file:
        for instance in instances():
            for name, allocator in loaded.items():
                for objective in OBJECTIVES:
                    endless = allocator.method.kind == "exact" and not ends_soon(instance, objective)
                    if not endless and (instance.name, name, objective) not in done:
                        row = {"instance": instance.name, "method": name, "objective": objective}
                        file.write(json.dumps(row | outcome(instance, allocator, objective)) + "\n")
                        file.flush()


def ends_soon(instance: Instance, objective: str) -> bool:
    """Whether an exact method, which has no iterations to count, proves its optimum in seconds."""
    whole = bool(np.all(instance.ability % 1 == 0)) and not instance.has_travel_time
    return instance.n < SMALL or (objective == "makespan" and whole and instance.n not in (SMALL, 80))


def outcome(instance: Instance, allocator: object, objective: str) -> dict[str, object]:
    """Return what `solve` finds, its floats in full."""
    name = allocator.method.name  # type: ignore[attr-defined]
    budget = ITERATIONS.get(name, FEW_ITERATIONS)
    try:
        result = solve(
            instance,
            allocator,  # type: ignore[arg-type]
            objective=objective,
            time_limit_s=None,
            iterations=budget,
            seed=1,
            threads=1,
        )
    except RefusedError:
        return {"status": "refused"}
    tasks = b"" if result.allocation is None else result.allocation.task_of_agent.astype(np.int64).tobytes()
    return {
        "status": str(result.status),
        "makespan": key(result.makespan),
        "served": key(None if result.evaluation is None else result.evaluation.served_makespan),
        "unserved": 0 if result.evaluation is None else len(result.evaluation.unserved_tasks),
        "energy": key(result.energy),
        "bound": key(result.lower_bound),
        "energy_bound": key(result.energy_lower_bound),
        "plan": hashlib.sha256(tasks).hexdigest()[:16],
    }


def rows(path: Path) -> list[dict[str, object]]:
    """Return the lines of a snapshot."""
    return [json.loads(line) for line in path.read_text().splitlines()]


def compare(before: Path, after: Path) -> int:
    """Print each difference and their number by method; 1 if there is any."""
    old, new = (
        {(row["instance"], row["method"], row["objective"]): row for row in rows(path)} for path in (before, after)
    )
    counts: Counter[str] = Counter()
    for which in old.keys() | new.keys():
        one, other = old.get(which, {}), new.get(which, {})
        changed = [f for f in one.keys() | other.keys() if one.get(f) != other.get(f)]
        if changed:
            counts[str(which[1])] += 1
            told = ", ".join(f"{f}: {told_value(one.get(f))} -> {told_value(other.get(f))}" for f in sorted(changed))
            print(*which, told)
    print(f"{len(old)} and {len(new)} runs, {sum(counts.values())} differ", dict(counts))
    return 1 if counts or old.keys() != new.keys() else 0


def told_value(value: object) -> object:
    """Return a float as people write it."""
    return repr(float.fromhex(value)) if isinstance(value, str) and "0x" in value else value


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["run", "compare"])
    parser.add_argument("files", type=Path, nargs="+")
    arguments = parser.parse_args()
    if arguments.what == "compare":
        sys.exit(compare(*arguments.files))
    run(*arguments.files)
