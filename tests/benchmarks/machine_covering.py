r"""Machine covering: gaps to proven bounds, and the published tables of plans and bounds.

    python tests/benchmarks/machine_covering.py --methods cpsat,plain --seeds 2 --time-limit 10
    python tests/benchmarks/machine_covering.py --families target,large --seeds 10 \
        --publish docs/benchmarks/benchmarks/machine-covering.csv
    python tests/benchmarks/machine_covering.py --families open --seeds 1 --processor-time --methods auto,local-search \
        --time-limit 10 --publish docs/benchmarks/machine-covering-open.csv

The first prints a line for each family and method: the mean gap (T - bound) / T to the method's own bound, how many are
proven, and T against the best bound of all methods in the run. `target` are families that this project has set itself
figures for; the others are of the kinds in the literature: `small` with n = 2m, 3m, 5m; `narrow` with n = 3m + 1 to
5m + 2; `large` with U[1, 1000]; `tight` with n / m = 2.5 and U[n/5, n/2]; `open` ones have abilities that are no whole
numbers, or agents bound to a few tasks. `plain` is one maximisation by CP-SAT over classes of agents, as it would be
stated without further thought. With --publish, plan and bound of the first method are written, with what proves the
bound, beside rows of other instances that the file has already.
"""

import argparse
import csv
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from ortools.sat.python import cp_model
from variant_kinds import clock_of_limits

from alloc.allocators import load, solve
from alloc.allocators.exact.makespan.configuration import ConfigurationProgramme
from alloc.allocators.exact.makespan.enumeration import enumerate_groups
from alloc.allocators.exact.makespan.relaxation import relaxed_lower_bound
from alloc.allocators.exact.makespan.set_partitioning import solve_set_partitioning
from alloc.allocators.exact.model import Model
from alloc.allocators.exact.solver_model import Verdict
from alloc.problems import Instance, agent_classes, machine_covering, makespan_lower_bound
from alloc.problems.generate.covering import EQUAL_WORKLOAD

CLOSE = 1e-7
"""A bound is proven if T less than this part below it is impossible."""

PROOF_S = 30.0
"""Seconds for prices and groups to prove a bound by themselves."""

Shape = tuple[int, int, int, int]
Maker = Callable[[int], Instance]
Run = tuple[float, float, float, str, str]
"""Makespan, bound, seconds, status and plan."""

SHAPES: dict[str, list[Shape]] = {
    "target": [(100, 25, 1, 1000), (200, 50, 1, 1000), (400, 100, 1, 1000), (100, 40, 20, 50), (40, 16, 1, 100),
               (60, 20, 1, 100), (30, 10, 100, 800)],
    "small": [(k * m, m, *ends) for m in (3, 4, 5) for k in (2, 3, 5) for ends in ((1, 20), (20, 50))],
    "narrow": [(k * m + more, m, *ends) for m in (3, 5, 7, 10) for k in (3, 4, 5) for more in (1, 2)
               for ends in ((1, 100), (100, 200))],
    "large": [(n, n // 4, 1, 1000) for n in (100, 200, 300, 400)],
    "tight": [(n, 2 * n // 5, n // 5, n // 2) for n in (20, 40, 60, 100, 140)],
}  # fmt: skip
"""Agents, tasks, and the range of the abilities."""


def restricted(shape: Shape, seed: int, *, equal: bool = True, whole: bool = True) -> Instance:
    """Return an instance in which each agent may take three tasks; each task is open to about as many agents."""
    agents, tasks, _, _ = shape
    plain = machine_covering(*shape, seed, equal=equal, whole=whole)
    rng = np.random.default_rng([agents, tasks, seed])
    lists = [np.unique(np.append(i % tasks, rng.choice(tasks, 2, replace=False))) for i in range(agents)]
    name = f"restricted-{plain.name}"
    return Instance(name=name, ability=plain.ability, workload=plain.workload, allowed_tasks=lists)


OPEN: dict[str, Maker] = {
    "real (100,40) U[20,50] equal": lambda seed: machine_covering(100, 40, 20, 50, seed, whole=False),
    "real (100,40) U[20,50] unequal": lambda seed: machine_covering(100, 40, 20, 50, seed, equal=False, whole=False),
    "real (90,30) U[1,100] unequal": lambda seed: machine_covering(90, 30, 1, 100, seed, equal=False, whole=False),
    "restricted (100,40) U[20,50] equal": lambda seed: restricted((100, 40, 20, 50), seed),
    "restricted (150,30) U[1,100] unequal": lambda seed: restricted((150, 30, 1, 100), seed, equal=False),
    "restricted real (100,25) U[1,100] unequal": lambda seed: restricted(
        (100, 25, 1, 100), seed, equal=False, whole=False
    ),
}


def families(names: list[str]) -> Iterator[tuple[str, dict[str, object], Maker]]:
    """Yield title, columns of the published table, and instances of each family."""
    for name in names:
        if name == "open":
            yield from ((title, {"family": title}, maker) for title, maker in OPEN.items())
            continue
        for shape in SHAPES[name]:
            owner = next(family for family, shapes in SHAPES.items() if shape in shapes)
            for equal in (True, False):
                agents, tasks, low, high = shape
                workloads = "equal" if equal else "unequal"
                columns = {"family": owner, "agents": agents, "tasks": tasks, "low": low, "high": high}
                yield (
                    f"({agents},{tasks}) U[{low},{high}] {workloads}",
                    {**columns, "workloads": workloads},
                    lambda seed, shape=shape, equal=equal: machine_covering(*shape, seed, equal=equal),
                )


def plain(instance: Instance, time_limit_s: float) -> Run:
    """Maximise 1 / T by CP-SAT over classes, abilities and workloads being whole numbers."""
    begin = time.monotonic()
    classes = agent_classes(instance, by_place=False)
    ability, work = classes.ability.astype(int).tolist(), instance.workload.astype(int).tolist()
    model, fine = cp_model.CpModel(), 10**6
    x = [[model.new_int_var(0, int(count), "") for _ in work] for count in classes.count]
    pace = model.new_int_var(0, int(fine * instance.ability.sum() / min(work)) + 1, "")
    for j, h in enumerate(work):
        model.add(fine * sum(a * x[k][j] for k, a in enumerate(ability)) >= h * pace)
    for row, count in zip(x, classes.count.tolist(), strict=True):
        model.add(sum(row) <= count)
    model.maximize(pace)
    solver = cp_model.CpSolver()
    solver.parameters.max_time_in_seconds, solver.parameters.num_workers = time_limit_s, 1
    status, bound = solver.solve(model), makespan_lower_bound(instance)
    makespan = np.inf
    if status in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        done = classes.ability @ np.array([[solver.value(v) for v in row] for row in x])
        makespan = float((instance.workload / np.maximum(done, 1e-300)).max())
        bound = max(bound, fine / max(solver.best_objective_bound + 1, 1))
    return makespan, bound, time.monotonic() - begin, "", ""


def measure(method: str, instance: Instance, time_limit_s: float) -> Run:
    """Run one method with one thread."""
    if method == "plain":
        return plain(instance, time_limit_s)
    allocator = method if method == "auto" else load(method)
    result = solve(instance, allocator, time_limit_s=time_limit_s, threads=1)
    plan = [] if result.allocation is None else result.allocation.task_of_agent
    assert result.lower_bound is not None
    makespan = np.inf if result.makespan is None else result.makespan
    text = " ".join("-" if task < 0 else str(task) for task in plan)
    return makespan, result.lower_bound, result.runtime_s, str(result.status), text


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


def published(columns: dict[str, object], seed: int, instance: Instance, runs: dict[str, Run]) -> dict[str, object]:
    """Return the row of an instance: of the first method, and of other ones the gap to its bound."""
    (makespan, bound, seconds, status, plan), *_ = runs.values()
    row = {**columns, "seed": seed, "makespan": makespan, "lower_bound": bound}
    end = {"seconds": round(seconds, 2), "proof": proof(instance, bound)}
    if "agents" not in columns:
        others = {name: f"{1 - bound / run[0]:.2e}" for name, run in list(runs.items())[1:]}
        return {**row, "gap": f"{(makespan - bound) / makespan:.2e}", **end, **others, "plan": plan}
    equal = columns["workloads"] == "equal"  # the figures of the literature: the least load, and its upper bound
    loads = (round(EQUAL_WORKLOAD / makespan), int(EQUAL_WORKLOAD / bound * (1 + 1e-9))) if equal else ("", "")
    return {**row, "min_load": loads[0], "min_load_bound": loads[1], "status": status, **end, "plan": plan}


def write(rows: list[dict[str, object]], file: Path) -> None:
    """Write rows, and what the file had of other instances, in the order of family and size."""
    known = {key(row): row for row in rows}
    if file.exists():
        with file.open(newline="") as text:
            known = {key(row): row for row in csv.DictReader(text)} | known
    with file.open("w", newline="") as text:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(known[place] for place in sorted(known))


def key(row: dict[str, object]) -> tuple[str, str, tuple[int, ...]]:
    """Return what tells instances apart, in the order of the table."""
    sizes = (int(str(row[name])) for name in ("tasks", "agents", "low", "high", "seed") if name in row)
    return str(row["family"]), str(row.get("workloads", "")), tuple(sizes)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--families", default="target", help=f"of {', '.join(SHAPES)} and open, comma between")
    parser.add_argument("--only", default="", help="families whose name contains this, such as (40,16)")
    parser.add_argument("--methods", default="cpsat", help="comma between; plain is the model without further thought")
    parser.add_argument("--time-limit", type=float, default=30.0)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--processor-time", action="store_true", help="limits count the time of this process alone")
    parser.add_argument("--publish", type=Path, metavar="FILE", help="write rows of the published table there")
    options = parser.parse_args()
    print("| family | method | mean gap | proven | mean T / bound | mean s |\n|---|---|---|---|---|---|")
    for title, columns, maker in families(options.families.split(",")):
        if options.only not in title:
            continue
        found: dict[str, list[Run]] = {method: [] for method in options.methods.split(",")}
        rows = []
        for seed in range(options.seeds):
            instance = maker(seed)
            with clock_of_limits(processor_time=options.processor_time):
                runs = {method: measure(method, instance, options.time_limit) for method in found}
                rows += [published(columns, seed, instance, runs)] if options.publish else []
            for method, run in runs.items():
                found[method].append(run)
        best = np.max([[run[1] for run in runs] for runs in found.values()], axis=0)
        for method, runs in found.items():
            makespan, bound, seconds = (np.array([run[place] for run in runs]) for place in range(3))
            gap = (makespan - bound) / makespan
            print(f"| {title} | {method} | {100 * gap.mean():.4f} % | {(gap <= 1e-6).sum()}/{len(runs)} "
                  f"| {(makespan / best).mean():.6f} | {seconds.mean():.2f} |", flush=True)  # fmt: skip
        if options.publish:
            write(rows, options.publish)


if __name__ == "__main__":
    main()
