"""Families of machine covering that still separate methods: real-valued abilities, and agents bound to a few tasks.

    python tests/benchmarks/machine_covering_open.py --seeds 2 --time-limit 10 \
        --publish docs/benchmarks/machine-covering-open.csv

`real` are the instances of `alloc.problems.machine_covering` with ``whole=False``. `restricted` ones have the abilities
and workloads of `machine_covering`, whole or not; agent i may take task i modulo m and two others, drawn by
``numpy.random.default_rng([agents, tasks, seed])``. Workloads that differ are machines of different speeds. Published
are the plan and the bound of `auto`, what proves the bound, and the gaps of other methods to that bound.
"""

import argparse
import csv
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from machine_covering_table import proof
from variant_kinds import clock_of_limits

from alloc.allocators import load, solve
from alloc.problems import Instance, machine_covering

OTHERS = ("local-search",)


def restricted(
    agents: int, tasks: int, low: int, high: int, seed: int, *, equal: bool = True, whole: bool = True
) -> Instance:
    """Return an instance in which each agent may take three tasks; each task is open to about as many agents."""
    plain = machine_covering(agents, tasks, low, high, seed, equal=equal, whole=whole)
    rng = np.random.default_rng([agents, tasks, seed])
    lists = [np.append(i % tasks, rng.choice(tasks, 2, replace=False)) for i in range(agents)]
    return Instance(
        name=f"restricted-{plain.name}",
        ability=plain.ability,
        workload=plain.workload,
        allowed_tasks=[np.unique(tasks_of) for tasks_of in lists],
    )


FAMILIES: dict[str, Callable[[int], Instance]] = {
    "real (100,40) U[20,50] equal": lambda seed: machine_covering(100, 40, 20, 50, seed, whole=False),
    "real (100,40) U[20,50] unequal": lambda seed: machine_covering(100, 40, 20, 50, seed, equal=False, whole=False),
    "real (90,30) U[1,100] unequal": lambda seed: machine_covering(90, 30, 1, 100, seed, equal=False, whole=False),
    "restricted (100,40) U[20,50] equal": lambda seed: restricted(100, 40, 20, 50, seed),
    "restricted (150,30) U[1,100] unequal": lambda seed: restricted(150, 30, 1, 100, seed, equal=False),
    "restricted real (100,25) U[1,100] unequal": lambda seed: restricted(
        100, 25, 1, 100, seed, equal=False, whole=False
    ),
}


def rows(family: str, seeds: int, limit: float, *, processor_time: bool) -> Iterator[dict[str, object]]:
    """Solve the instances of one family, and yield the published rows."""
    for seed in range(seeds):
        case = FAMILIES[family](seed)
        with clock_of_limits(processor_time=processor_time):
            result = solve(case, time_limit_s=limit, threads=1)
            others = {name: solve(case, load(name), time_limit_s=limit, threads=1).makespan for name in OTHERS}
            assert result.lower_bound is not None
            proven_by = proof(case, result.lower_bound)
        assert result.allocation is not None
        assert result.makespan is not None
        yield {
            "family": family,
            "seed": seed,
            "makespan": result.makespan,
            "lower_bound": result.lower_bound,
            "gap": f"{result.gap:.2e}",
            "seconds": round(result.runtime_s, 2),
            "proof": proven_by,
            **{
                name: "" if makespan is None else f"{1 - result.lower_bound / makespan:.2e}"
                for name, makespan in others.items()
            },
            "plan": " ".join("-" if task < 0 else str(task) for task in result.allocation.task_of_agent),
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", default="", help="those whose name contains this")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--time-limit", type=float, default=10.0, help="seconds")
    parser.add_argument("--processor-time", action="store_true", help="limits count the time of this process alone")
    parser.add_argument("--publish", type=Path, metavar="FILE", help="write the table there")
    options = parser.parse_args()
    found: list[dict[str, object]] = []
    for family in FAMILIES:
        if options.families not in family:
            continue
        for row in rows(family, options.seeds, options.time_limit, processor_time=options.processor_time):
            found.append(row)
            print(*(value for name, value in row.items() if name != "plan"), sep=", ", flush=True)
            if options.publish is not None:
                write(found, options.publish)


def write(found: list[dict[str, object]], file: Path) -> None:
    """Write the table so far."""
    with file.open("w", newline="") as text:
        writer = csv.DictWriter(text, list(found[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)


if __name__ == "__main__":
    main()
