"""A comparison whose runs are kept in a store: only those are made that it has not yet."""

import sys
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from alloc.cli.commands.experiments.options import Keeping
from alloc.cli.commands.experiments.sources import gather
from alloc.cli.output.console import is_terminal, note, say, table
from alloc.problems.text import counted, number

if TYPE_CHECKING:
    from alloc.allocators import Budget
    from alloc.allocators.experiments.compare import Row
    from alloc.allocators.experiments.store.key import Run
    from alloc.allocators.experiments.store.outcome import Ending
    from alloc.allocators.experiments.stored import Comparison, Endings


@dataclass(frozen=True)
class Found:
    """What a comparison came to.

    Attributes
    ----------
    comparison : Comparison
    endings : mapping
        How its runs ended.
    rows : list of Row
        From the store, of exactly what was asked for, with the gaps against the best bound of any method.
    is_complete : bool
        Whether all runs have ended.
    notes : list of str
        For the user, after the table.
    """

    comparison: "Comparison"
    endings: "Endings"
    rows: "list[Row]"
    is_complete: bool
    notes: list[str]

    def conclude(self, reports: Sequence[str], *, quiet: bool) -> int:
        """Print how methods differ, unless `quiet`, and the notes, write the reports, and return the exit code."""
        from alloc.allocators.experiments.report.files import write_report

        if not quiet and len(self.endings) > 1:
            self._tell_differences()
        for one in self.notes:
            note(one)
        for file in reports:
            write_report(file, self.comparison, self.endings, self.rows)
        is_served = any(row.runs for row in self.rows) and not any(row.unserved for row in self.rows)
        return 0 if self.is_complete and is_served else 1

    def _tell_differences(self) -> None:
        from alloc.allocators.experiments.report.tables import difference_tables

        for found in difference_tables(self.comparison, self.endings):
            say(f"\n{found.title}\n{table(found.header, found.rows)}")
            for one in found.notes:
                note(one)


def compare_in_store(
    keeping: Keeping,
    sources: Sequence[str],
    methods: Mapping[str, tuple[str, Mapping[str, object]]],
    seeds: Sequence[int],
    objective: str,
    budget: "Budget",
    threads: int | None,
) -> Found:
    """Make the runs that are missing, until all are there or a signal comes, and return what the store says of all."""
    from alloc.allocators.experiments.campaign import Campaign, Means
    from alloc.allocators.experiments.compare import share_bounds
    from alloc.allocators.experiments.report.files import check_report
    from alloc.allocators.experiments.store.outcome import UNSOLVED
    from alloc.allocators.experiments.store.store import Store
    from alloc.allocators.experiments.stored import doubts, planned, rows_of
    from alloc.allocators.runtime.interrupts import signals_set

    for file in keeping.reports:
        check_report(file)
    for name, settings in methods.values():
        _check_method(name, settings)
    instances = gather(list(sources))
    stop = threading.Event()
    with Store(keeping.store, again=UNSOLVED if keeping.retry else ()) as store:
        plan = planned(store, instances, methods, seeds, objective=objective, budget=budget, threads=threads)
        names = {job.run.key: f"{job.instance.name}, {label}" for (_, label, _), job in plan.jobs.items()}
        progress = _Progress(names)
        means = Means(keeping.workers, keeping.memory_mb, keeping.kill_after_s)
        with signals_set(stop):
            done = Campaign(store, list(plan.jobs.values()), means, progress.tell, _say_waiting).run(stop)
        endings = plan.endings(store)
        notes = [f"{counted(progress.made, 'run')} made; {keeping.store} has {_count(endings)} of {len(plan.jobs)}"]
        notes += [f"{keeping.store} also holds {other}, which do not count here" for other in plan.others(store)]
        notes += doubts(endings)
    if not done:
        notes.insert(0, "interrupted; the same command goes on from here")
    return Found(plan, endings, share_bounds(rows_of(plan, endings)), done, notes)


def _check_method(name: str, settings: Mapping[str, object]) -> None:
    """Raise an error if there is no such method, or it does not take these parameters."""
    from alloc.allocators import describe, load

    if settings:
        load(name, **settings)
    elif name != "auto":
        describe(name)


def _count(endings: "Mapping[str, Sequence[Sequence[Ending | None]]]") -> int:
    return sum(one is not None for lists in endings.values() for some in lists for one in some)


def _say_waiting() -> None:
    note("other commands have all processors; waiting for one")


class _Progress:
    """Says on a terminal how each run ended."""

    def __init__(self, names: Mapping[str, str]) -> None:
        self._names, self._shows, self.made = names, is_terminal(sys.stderr), 0

    def tell(self, run: "Run", ending: "Ending") -> None:
        """Count a run, and print how it ended."""
        self.made += 1
        if self._shows:
            outcome = f"T {number(ending.makespan)}" if not ending.reason else f"{ending.outcome}: {ending.reason}"
            say(f"[{self.made}] {self._names[run.key]}, seed {run.seed}: {outcome}")
