r"""Machine covering: the published tables of plans and bounds, made anew by runs as `alloc compare --store` makes them.

    python tests/benchmarks/machine_covering.py docs/benchmarks/machine-covering.csv --families target --store runs.db
    python tests/benchmarks/machine_covering.py docs/benchmarks/machine-covering-open.csv --methods auto local-search \
        --time-limit 10 --store runs.db

The column `instance` of a table says what it is of, as for `alloc compare`; a new row needs no more. Figures are of the
first method; of others there is the gap to its bound. `experiments.py covering` compares methods.
"""

import argparse
import csv
import sqlite3
import time
from pathlib import Path

from experiments import ran

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
from alloc.cli.commands.experiments.sources import gather
from alloc.problems import Instance, agent_classes, makespan_lower_bound
from alloc.problems.generate.covering import EQUAL_WORKLOAD

CLOSE = 1e-7
"""A bound is proven if T less than this part below it is impossible."""

PROOF_S = 30.0
"""Seconds for prices and groups to prove a bound by themselves."""

Row = dict[str, str]


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


def figures(row: Row, instance: Instance, runs: dict[str, Ending], plan: str) -> Row:
    """Return all figures of an instance that a table may have."""
    first, *_ = runs.values()
    makespan, bound = first.makespan, first.lower_bound
    assert makespan is not None, f"{instance.name}: {first}"
    assert bound is not None
    found: dict[str, object] = {
        name: f"{1 - bound / run.makespan:.2e}" if run.makespan else "" for name, run in runs.items()
    }
    found |= {"makespan": makespan, "lower_bound": bound, "gap": f"{(makespan - bound) / makespan:.2e}"}
    found |= {"status": first.status, "seconds": round(first.runtime_s or 0.0, 2), "proof": proof(instance, bound)}
    found["plan"] = plan
    if row.get("workloads") == "equal":  # the figures of the literature: the least load, and its upper bound
        found["min_load"] = round(EQUAL_WORKLOAD / makespan)
        found["min_load_bound"] = int(EQUAL_WORKLOAD / bound * (1 + 1e-9))
    return {name: str(value) for name, value in found.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("table", type=Path)
    parser.add_argument("--families", nargs="+", help="of the table; all by default")
    parser.add_argument("--methods", nargs="+", default=["cpsat"])
    parser.add_argument("--time-limit", type=float, default=30.0)
    parser.add_argument("--store", type=Path, required=True, metavar="FILE", help="where runs are kept")
    options = parser.parse_args()
    with options.table.open(newline="") as text:
        table = list(csv.DictReader(text))
    rows = [row for row in table if options.families is None or row["family"] in options.families]
    instances = gather([row["instance"] for row in rows])
    with Store(options.store) as store, sqlite3.connect(options.store) as kept:
        comparison, found = ran(store, instances, options.methods, Budget(options.time_limit))
        for number, (row, instance) in enumerate(zip(rows, instances, strict=True)):
            runs = {method: endings[number][0] for method, endings in found.items()}
            key = comparison.jobs[number, options.methods[0], 0].run.key
            (packed,) = kept.execute("SELECT plan FROM plans WHERE key = ?", [key]).fetchone()
            plan = " ".join("-" if task < 0 else str(task) for task in unpacked(packed).task_of_agent)
            row |= {name: value for name, value in figures(row, instance, runs, plan).items() if name in row}
    with options.table.open("w", newline="") as text:
        writer = csv.DictWriter(text, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    print(f"{len(rows)} rows of {options.table}")


if __name__ == "__main__":
    main()
