"""The published table of machine covering: rows with plans and bounds, and what proves the bounds.

`machine_covering.py --publish FILE` writes it; rows of instances that were not run again stay.
"""

import csv
import time
from dataclasses import asdict, dataclass, fields
from pathlib import Path

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


@dataclass(frozen=True)
class Entry:
    """One instance; `plan` is the index of each agent's task, with `-` for none, blanks between.

    `min_load` and `min_load_bound` are the figures of the literature, for equal workloads: the least total ability on a
    task, and what it can be at the most.
    """

    family: str
    agents: int
    tasks: int
    low: int
    high: int
    workloads: str
    seed: int
    makespan: float
    lower_bound: float
    min_load: int | None
    min_load_bound: int | None
    status: str
    seconds: float
    proof: str
    plan: str

    @property
    def key(self) -> tuple[str, ...]:
        """What tells instances apart, as text."""
        return tuple(str(part) for part in (self.agents, self.tasks, self.low, self.high, self.workloads, self.seed))


def entry(family: str, shape: tuple[int, int, int, int], seed: int, *, equal: bool, time_limit_s: float) -> Entry:
    """Solve one instance by `cpsat` with one thread, and see what proves the bound."""
    instance = machine_covering(*shape, seed, equal=equal)
    result = solve(instance, load("cpsat"), objective="makespan", time_limit_s=time_limit_s, threads=1)
    assert result.makespan is not None
    assert result.lower_bound is not None
    tasks = result.allocation.task_of_agent if result.allocation is not None else []
    return Entry(
        family, *shape, "equal" if equal else "unequal", seed, result.makespan, result.lower_bound,
        round(EQUAL_WORKLOAD / result.makespan) if equal else None,
        int(EQUAL_WORKLOAD / result.lower_bound * (1 + 1e-9)) if equal else None,
        str(result.status), round(result.runtime_s, 2), proof(instance, result.lower_bound),
        " ".join("-" if task < 0 else str(task) for task in tasks),
    )  # fmt: skip


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


def write_table(entries: list[Entry], file: Path) -> None:
    """Write the entries, and what the file had of other instances, in the order of family, size and seed."""
    rows = {line.key: {name: str(value) for name, value in _named(line).items()} for line in entries}
    if file.exists():
        with file.open(newline="") as text:
            for row in csv.DictReader(text):
                rows.setdefault(tuple(row[name] for name in KEY), row)
    order = sorted(rows.values(), key=lambda row: (row["family"], row["workloads"], *(int(row[name]) for name in SIZE)))
    with file.open("w", newline="") as text:
        writer = csv.DictWriter(text, [field.name for field in fields(Entry)], lineterminator="\n")
        writer.writeheader()
        writer.writerows(order)


KEY = ("agents", "tasks", "low", "high", "workloads", "seed")
SIZE = ("tasks", "agents", "low", "high", "seed")


def _named(line: Entry) -> dict[str, object]:
    return {name: "" if value is None else value for name, value in asdict(line).items()}
