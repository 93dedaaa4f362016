"""Runs of methods by name on instances by name, for the tables of the learned methods: measured, kept, published.

Every run is in a process of its own kind: `jobs` workers, each with every method loaded once and warmed up on a small
instance, solve one instance at a time. With two workers of one thread each, figures are those of one core, and take
half as long to come by; the memory bandwidth is shared, so that both are at most a little slower than alone.
"""

import argparse
import csv
import gc
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, fields
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from learned_families import ALL

from alloc.allocators import RefusedError, load, names, solve
from alloc.allocators.contract.base import Allocator
from alloc.problems import Family, random_instance

PAGE = Path(__file__).parents[2] / "docs" / "benchmarks" / "learned_methods.md"
EQUAL = 1e-9
"""Relative difference up to which two makespans or energies are equal, as for the evaluator."""

ENOUGH = 0.9
"""Share of a core below which the time that a run was given is not to be believed."""


@dataclass(frozen=True, order=True)
class Task:
    """One run to be made."""

    objective: str
    family: str
    seed: int
    time_limit: float
    threads: int
    method: str


@dataclass(frozen=True)
class Row:
    """What came of it: makespans in hours (served tasks alone in `served`), energy, seconds; `why` there is nothing.

    `busy` is processor time over wall-clock time: well below 1, something else had the core, or the method waited.
    """

    task: Task
    makespan: float = np.inf
    served: float = np.inf
    energy: float = np.nan
    unserved: int = 0
    seconds: float = np.nan
    first_seconds: float = np.nan
    first_makespan: float = np.nan
    bound: float = 0.0
    busy: float = np.nan
    why: str = ""

    @property
    def score(self) -> tuple[int, float, float]:
        """What is compared, the less the better."""
        energy = self.energy if self.task.objective == "makespan-energy" else 0.0
        return (10**9, np.inf, np.inf) if self.why else (self.unserved, self.served, energy)

    @property
    def late(self) -> bool:
        """Whether it took far more time than the others were given."""
        return self.seconds > 1.2 * self.task.time_limit + 0.02


def better(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Whether the first is less, in lexicographic order, where what differs in rounding alone is equal."""
    for mine, yours in zip(one, other, strict=True):
        if mine != yours and not abs(mine - yours) <= EQUAL * max(abs(mine), abs(yours)):
            return mine < yours
    return False


@cache
def loaded(method: str) -> Allocator:
    """Load a method, and let it run once: compilers and thread pools are part of loading."""
    allocator = load(method)
    solve(random_instance(Family(agents=12, tasks=3), 0), allocator, objective="makespan-energy", time_limit_s=0.3)
    return allocator


def measure(task: Task, *, first_only: bool = False) -> Row:
    """Make one run, on an instance made for it: what instances remember would favour whoever comes second."""
    allocator, instance = loaded(task.method), ALL[task.family](task.seed)
    enough = threading.Event()
    gc.collect()
    begin, spent = time.monotonic(), time.process_time()
    try:
        result = solve(
            instance,
            allocator,
            objective=task.objective,
            time_limit_s=task.time_limit,
            threads=task.threads,
            seed=task.seed,
            stop=enough,
            on_improvement=(lambda _: enough.set()) if first_only else None,
        )
    except RefusedError as refused:
        return Row(task, why="refused: " + str(refused).partition(": ")[2].partition(";")[0])
    except Exception as error:  # a failure is a figure too
        return Row(task, why=f"failed: {type(error).__name__}: {error}"[:200])
    if result.evaluation is None:
        return Row(task, why="no answer", seconds=result.runtime_s)
    score, first = result.evaluation, result.trace[0]
    return Row(
        task,
        makespan=np.inf if score.makespan is None else score.makespan,
        served=score.served_makespan,
        energy=score.energy,
        unserved=len(score.unserved_tasks),
        seconds=result.runtime_s,
        first_seconds=first.time_s,
        first_makespan=np.nan if first.makespan is None else first.makespan,
        bound=result.lower_bound or 0.0,
        busy=(time.process_time() - spent) / max(time.monotonic() - begin, 1e-9),
    )


def measure_first(task: Task) -> Row:
    """Make one run that ends at its first answer."""
    return measure(task, first_only=True)


def run(
    tasks: Iterable[Task], *, jobs: int, kept: Path | None, again: Iterable[str] = (), first: bool = False
) -> list[Row]:
    """Return a row per task, in order; those that the file `kept` has already are not run anew, unless `again`.

    Rows are appended to the file as they come, so that a run that was cut off goes on where it ended.
    """
    tasks, again = list(tasks), set(again)
    done = {row.task: row for row in read(kept) if row.task.method not in again}
    if kept is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        write(kept, done.values())
    left = [task for task in tasks if task not in done]
    for count, row in enumerate(_workers(left, jobs, first), start=1):
        done[row.task] = row
        if kept is not None:
            write(kept, [row], mode="a")
        if sys.stderr.isatty() or count % 50 == 0:
            print(f"{count} of {len(left)} runs: {row.task.method}, {row.task.family}", file=sys.stderr, flush=True)
    if kept is not None:
        write(kept, [done[task] for task in sorted(done)])
    poor = sum(done[task].busy < ENOUGH for task in tasks)
    if poor:
        print(
            f"{poor} of {len(tasks)} runs had less than {ENOUGH:.0%} of a core: is the machine busy?", file=sys.stderr
        )
    return [done[task] for task in tasks]


def _workers(tasks: list[Task], jobs: int, first: bool) -> Iterator[Row]:
    if not tasks:
        return
    os.environ["OMP_NUM_THREADS"] = str(max(task.threads for task in tasks))  # libraries read it when they are loaded
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(measure_first if first else measure, tasks)


def read(path: Path | None) -> list[Row]:
    """Return the rows of a file, none where it does not exist."""
    if path is None or not path.exists():
        return []
    kinds = {field.name: field.type for field in (*fields(Task), *fields(Row))}
    rows = []
    with path.open(newline="", encoding="utf-8") as file:
        for line in csv.DictReader(file):
            values = {name: kinds[name](text) for name, text in line.items()}  # type: ignore[operator]
            task = Task(**{field.name: values.pop(field.name) for field in fields(Task)})
            rows.append(Row(task, **values))
    return rows


def write(path: Path, rows: Iterable[Row], mode: str = "w") -> None:
    """Write rows with a header, or append them without."""
    columns = [*(field.name for field in fields(Task)), *(field.name for field in fields(Row) if field.name != "task")]
    with path.open(mode, newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        if mode == "w":
            table.writeheader()
        for row in rows:
            flat = asdict(row)
            flat |= flat.pop("task")
            table.writerow({key: repr(float(f"{v:.10g}")) if isinstance(v, float) else v for key, v in flat.items()})


def crossed(
    objectives: Iterable[str],
    families: Iterable[str],
    seeds: int,
    limits: Iterable[float],
    threads: int,
    methods: Iterable[str],
) -> list[Task]:
    """Return all runs; the methods take turns, so that what else the machine does hits all alike."""
    return [Task(*each) for each in product(objectives, families, range(seeds), limits, [threads], methods)]


def known(methods: str) -> list[str]:
    """Return the methods, split by commas, that are there; say which are not."""
    chosen = methods.split(",")
    for name in sorted(set(chosen) - set(names())):
        print(f"there is no method {name}; it is left out", file=sys.stderr)
    return [name for name in chosen if name in names()]


def add_options(parser: argparse.ArgumentParser, *, methods: str, seeds: int, threads: int = 1) -> None:
    """Add what all these scripts take."""
    parser.add_argument(
        "--methods", default=methods, help="names split by commas; those that are not there are left out"
    )
    parser.add_argument("--seeds", type=int, default=seeds, help="instances per scenario or family")
    parser.add_argument("--threads", type=int, default=threads, help="threads of each run")
    parser.add_argument("--jobs", type=int, default=1, help="runs at a time; with --threads 1 figures are of one core")
    parser.add_argument("--runs", type=Path, metavar="CSV", help="keep all runs there, and do not make them anew")
    parser.add_argument("--again", default="", metavar="METHODS", help="make the runs of these anew all the same")
    parser.add_argument("--publish", action="store_true", help=f"put the tables into docs/benchmarks/{PAGE.name}")


def table(head: str, lines: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table; columns after the first are right-aligned where the head ends in a colon."""
    columns = [column.strip() for column in head.split("|")]
    rule = ["--:" if column.endswith(":") else "---" for column in columns]
    rows = [[column.removesuffix(":") for column in columns], rule, *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def publish(script: str, text: str) -> None:
    """Put `text` between the marks of `script` in the page."""
    begin, end = f"<!-- made by tests/benchmarks/{script} -->", f"<!-- end of {script} -->"
    page = PAGE.read_text(encoding="utf-8")
    before, found, rest = page.partition(begin)
    if not found or end not in rest:
        raise ValueError(f"{PAGE} has no marks {begin} and {end}")
    PAGE.write_text(f"{before}{begin}\n\n{text}\n\n{end}{rest.partition(end)[2]}", encoding="utf-8")
