r"""Machine covering: the published tables of plans and bounds, of runs as `alloc compare --store` makes them.

    python tests/benchmarks/machine_covering.py target large --seeds 10 --store runs.db \
        --publish docs/benchmarks/machine-covering.csv
    python tests/benchmarks/machine_covering.py open --seeds 1 --methods auto local-search --time-limit 10 \
        --store runs.db --publish docs/benchmarks/machine-covering-open.csv

Rows are of the first method; of others they have the gap to its bound, where families are `open`. Rows of other
instances stay in the file. `target` are families that this project has set itself figures for; the others are of the
kinds in the literature: `small` with n = 2m, 3m, 5m; `narrow` with n = 3m + 1 to 5m + 2; `large` with U[1, 1000];
`tight` with n / m = 2.5 and U[n/5, n/2]; `open` ones are those of `kinds.py`. `experiments.py covering` compares
methods on `target`.
"""

import argparse
import csv
import sqlite3
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from experiments import ran
from kinds import OPEN, Maker

from alloc.allocators import Budget
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.enumeration import enumerate_groups
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.makespan.set_partitioning import solve_set_partitioning
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import Verdict
from alloc.allocators.experiments.store.outcome import Ending
from alloc.allocators.experiments.store.plan import unpacked
from alloc.allocators.experiments.store.store import Store
from alloc.problems import Instance, agent_classes, machine_covering, makespan_lower_bound
from alloc.problems.generate.covering import EQUAL_WORKLOAD

CLOSE = 1e-7
"""A bound is proven if T less than this part below it is impossible."""

PROOF_S = 30.0
"""Seconds for prices and groups to prove a bound by themselves."""

SHAPES: dict[str, list[tuple[int, int, int, int]]] = {
    "target": [(100, 25, 1, 1000), (200, 50, 1, 1000), (400, 100, 1, 1000), (100, 40, 20, 50), (40, 16, 1, 100),
               (60, 20, 1, 100), (30, 10, 100, 800)],
    "small": [(k * m, m, *ends) for m in (3, 4, 5) for k in (2, 3, 5) for ends in ((1, 20), (20, 50))],
    "narrow": [(k * m + more, m, *ends) for m in (3, 5, 7, 10) for k in (3, 4, 5) for more in (1, 2)
               for ends in ((1, 100), (100, 200))],
    "large": [(n, n // 4, 1, 1000) for n in (100, 200, 300, 400)],
    "tight": [(n, 2 * n // 5, n // 5, n // 2) for n in (20, 40, 60, 100, 140)],
}  # fmt: skip
"""Agents, tasks, and the range of the abilities."""


def families(names: list[str]) -> Iterator[tuple[dict[str, object], Maker]]:
    """Yield columns of the published table, and instances of each family."""
    for name in names:
        if name == "open":
            yield from (({"family": title}, maker) for title, maker in OPEN.items())
            continue
        for shape in SHAPES[name]:
            owner = next(family for family, shapes in SHAPES.items() if shape in shapes)
            for equal in (True, False):
                columns = dict(zip(("agents", "tasks", "low", "high"), shape, strict=True))
                workloads = "equal" if equal else "unequal"
                yield {"family": owner, **columns, "workloads": workloads}, partial(_covering, shape, equal)


def _covering(shape: tuple[int, int, int, int], equal: bool, seed: int) -> Instance:
    return machine_covering(*shape, seed, equal=equal)


def proof(instance: Instance, bound: float) -> str:
    """Return the simplest means that proves the bound by itself: simple, fractions, prices or groups; else search."""
    low = makespan_lower_bound(instance)
    if low >= bound * (1 - CLOSE):
        return "simple"
    until_s, below = time.monotonic() + PROOF_S, bound * (1 - CLOSE)

    def over() -> bool:
        return time.monotonic() > until_s

    model = Model.build(instance, agent_classes(instance, by_place=False), len(instance.workload))
    if not instance.reach.is_complete and relaxed_lower_bound(model, low, bound, PROOF_S, over)[0] >= below:
        return "fractions"
    configurations = ConfigurationProgramme(model, low)
    finer = configurations if configurations.is_tractable else None
    while finer is not None:
        configurations = finer
        prices = configurations.dual_prices(below, over, converge=True)
        if prices is None:
            return "search"
        if prices.theta > 1:
            return "prices"
        programme = enumerate_groups(configurations, prices, below, over)
        if programme is not None and not over():
            verdict, _ = solve_set_partitioning(programme, 0, over)
            if verdict is Verdict.INFEASIBLE:
                return "groups"
        finer = configurations.refined(low)
    return "search"


def published(
    columns: dict[str, object], seed: int, instance: Instance, runs: dict[str, Ending], plan: str
) -> dict[str, object]:
    """Return the row of an instance: of the first method, and of other ones the gap to its bound."""
    first, *_ = runs.values()
    makespan, bound = first.makespan, first.lower_bound
    row = {**columns, "seed": seed, "makespan": makespan, "lower_bound": bound}
    end = {"seconds": round(first.runtime_s, 2), "proof": proof(instance, bound)}
    if "agents" not in columns:
        others = {
            name: f"{1 - bound / run.makespan:.2e}" if run.makespan else "" for name, run in list(runs.items())[1:]
        }
        return {**row, "gap": f"{(makespan - bound) / makespan:.2e}", **end, **others, "plan": plan}
    equal = columns["workloads"] == "equal"  # the figures of the literature: the least load, and its upper bound
    loads = (round(EQUAL_WORKLOAD / makespan), int(EQUAL_WORKLOAD / bound * (1 + 1e-9))) if equal else ("", "")
    return {**row, "min_load": loads[0], "min_load_bound": loads[1], "status": first.status, **end, "plan": plan}


def write(rows: list[dict[str, object]], file: Path) -> None:
    """Write rows, and what the file had of other instances, in the order of family and size."""
    known = {key(row): row for row in rows}
    if file.exists():
        with file.open(newline="") as text:
            known = {key(row): row for row in csv.DictReader(text)} | known
    fields = list(dict.fromkeys(name for row in (rows[0], *known.values()) for name in row))
    with file.open("w", newline="") as text:
        writer = csv.DictWriter(text, fields, lineterminator="\n")
        writer.writeheader()
        writer.writerows(known[place] for place in sorted(known))


def key(row: dict[str, object]) -> tuple[str, str, tuple[int, ...]]:
    """Return what tells instances apart, in the order of the table."""
    sizes = (int(str(row[name])) for name in ("tasks", "agents", "low", "high", "seed") if name in row)
    return str(row["family"]), str(row.get("workloads", "")), tuple(sizes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("families", nargs="+", choices=[*SHAPES, "open"])
    parser.add_argument("--methods", nargs="+", default=["cpsat"])
    parser.add_argument("--time-limit", type=float, default=30.0)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--store", type=Path, required=True, metavar="FILE", help="where runs are kept")
    parser.add_argument("--publish", type=Path, required=True, metavar="FILE", help="the table")
    options = parser.parse_args()
    with Store(options.store) as store, sqlite3.connect(options.store) as kept:
        for columns, maker in families(options.families):
            instances = [maker(seed) for seed in range(options.seeds)]
            comparison, found = ran(store, instances, options.methods, Budget(options.time_limit))
            rows = []
            for seed, instance in enumerate(instances):
                runs = {method: endings[seed] for method, endings in found.items()}
                key = comparison.jobs[seed, options.methods[0], 0].run.key
                tasks = unpacked(
                    kept.execute("SELECT plan FROM plans WHERE key = ?", [key]).fetchone()[0]
                ).task_of_agent
                plan = " ".join("-" if task < 0 else str(task) for task in tasks)
                rows.append(published(columns, seed, instance, runs, plan))
            write(rows, options.publish)
            print(f"{len(rows)} rows of {columns}", flush=True)


if __name__ == "__main__":
    main()
