"""Comparisons with a store, which make only the runs that are missing in it."""

import contextlib
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from alloc.cli.commands.experiments.options import Engine, MethodRuns, StoreOptions
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.output.console import is_terminal, note, say, table
from alloc.problems.text import counted, number

if TYPE_CHECKING:
    from alloc.allocators.experiments.compare import Row
    from alloc.allocators.experiments.isolation.places import Place
    from alloc.allocators.experiments.store.key import Run
    from alloc.allocators.experiments.store.outcome import Ending
    from alloc.allocators.experiments.store.store import Store
    from alloc.allocators.experiments.stored import Comparison, Endings


@dataclass(frozen=True)
class StoredComparison:
    """Outcome of a comparison.

    Attributes
    ----------
    comparison : Comparison
    endings : mapping
        How its runs ended.
    is_complete : bool
        Whether all runs have ended.
    notes : list of str
        Notes for the user, printed after the table.
    """

    comparison: "Comparison"
    endings: "Endings"
    is_complete: bool
    notes: list[str]


def make_missing(storage: StoreOptions, plan: Callable[["Store", str], "Comparison"]) -> StoredComparison:
    """Make the runs that are missing in a store, until all are complete or a signal arrives, and return all endings.

    Parameters
    ----------
    storage : StoreOptions
    plan : callable
        Returns all runs, given the store and the machine that executes them.
    """
    from alloc.allocators.experiments.campaign import Campaign, Resources
    from alloc.allocators.experiments.report.files import check_report
    from alloc.allocators.experiments.store.outcome import UNSOLVED
    from alloc.allocators.experiments.store.store import Store
    from alloc.allocators.experiments.stored import doubts
    from alloc.allocators.runtime.interrupts import signals_set

    for file in storage.reports:
        check_report(file)
    stop = threading.Event()
    again = UNSOLVED if storage.retry else ()
    with _place(storage) as place, Store(storage.store, again=again) as store:
        planned = plan(store, place.machine)
        names = {job.run.key: f"{job.instance.name}, {label}" for (_, label, _), job in planned.jobs.items()}
        progress = _Progress(names)
        resources = Resources(storage.workers, storage.memory_mb, storage.kill_after_s)
        with signals_set(stop):
            done = Campaign(store, list(planned.jobs.values()), resources, progress.tell, _say_waiting, place).run(stop)
        endings = planned.endings(store)
        notes = [f"{counted(progress.made, 'run')} made; {storage.store} has {_count(endings)} of {len(planned.jobs)}"]
        notes += [f"{storage.store} also contains {other}, which are ignored here" for other in planned.others(store)]
        notes += doubts(endings)
    if not done:
        notes.insert(0, "interrupted; the same command resumes from here")
    return StoredComparison(planned, endings, done, notes)


def _place(storage: StoreOptions) -> "Place":
    """Return the place where runs are executed."""
    if storage.engine is Engine.RAY:
        from alloc.allocators.experiments.isolation.cluster import Cluster

        return Cluster(storage.address)
    from alloc.allocators.experiments.isolation.places import ThisMachine

    return ThisMachine()


def compare_in_store(
    storage: StoreOptions, methods: Mapping[str, tuple[str, Mapping[str, object]]], runs: MethodRuns
) -> "tuple[StoredComparison, list[Row]]":
    """Compare methods, and return the outcome and its rows, with gaps to the best bound of any method."""
    from alloc.allocators.experiments.compare import share_bounds
    from alloc.allocators.experiments.stored import planned, rows_of

    for name, settings in methods.values():
        _check_method(name, settings)
    instances = gather(runs.sources)

    def plan(store: "Store", machine: str) -> "Comparison":
        return planned(
            store,
            instances,
            methods,
            runs.seeds,
            objective=runs.objective,
            budget=runs.budget,
            threads=runs.threads,
            machine=machine,
        )

    stored = make_missing(storage, plan)
    return stored, share_bounds(rows_of(stored.comparison, stored.endings))


def conclude(storage: StoreOptions, stored: StoredComparison, rows: "list[Row]", *, quiet: bool) -> int:
    """Print the differences of methods (unless `quiet`) and the notes, write the reports, and return the exit code."""
    from alloc.allocators.experiments.report.files import write_report
    from alloc.allocators.experiments.report.tables import report_tables

    if not quiet and sum(any(map(any, lists)) for lists in stored.endings.values()) > 1:
        _tell_differences(stored)
    for one in stored.notes:
        note(one)
    for file in storage.reports:
        write_report(
            file, stored.comparison, stored.endings, partial(report_tables, stored.comparison, stored.endings, rows)
        )
    is_served = any(row.runs for row in rows) and not any(row.unserved for row in rows)
    return 0 if stored.is_complete and is_served else 1


def _tell_differences(stored: StoredComparison) -> None:
    from alloc.allocators.experiments.report.tables import difference_tables

    for found in difference_tables(stored.comparison, stored.endings):
        say(f"\n{found.title}\n{table(found.header, found.rows)}")
        for one in found.notes:
            note(one)


def _check_method(name: str, settings: Mapping[str, object]) -> None:
    """Raise an error if the method does not exist or does not take these parameters."""
    from alloc.allocators import describe, load
    from alloc.problems import MissingPackageError

    if settings:
        with contextlib.suppress(MissingPackageError):  # reported by its runs
            load(name, **settings)
    elif name != "auto":
        describe(name)


def _count(endings: "Mapping[str, Sequence[Sequence[Ending | None]]]") -> int:
    return sum(one is not None for lists in endings.values() for some in lists for one in some)


def _say_waiting() -> None:
    note("other commands use all processors; waiting for one")


class _Progress:
    """Prints on a terminal how each run ended."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self._names, self._shows, self.made = names, is_terminal(sys.stderr), 0

    def tell(self, run: "Run", ending: "Ending") -> None:
        """Count a run, and print how it ended."""
        self.made += 1
        if self._shows:
            solved = ending.status if ending.measures else f"T {number(ending.makespan)}"
            outcome = f"{ending.outcome}: {ending.reason}" if ending.reason else solved
            say(f"[{self.made}] {self._names[run.key]}, seed {run.seed}: {outcome}")
