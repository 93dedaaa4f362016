"""``alloc reproduce``."""

import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli.options import examples
from alloc.cli.output.console import is_terminal, note, say
from alloc.problems.text import counted

if TYPE_CHECKING:
    from alloc.allocators.experiments.reproduction.folder import Folder
    from alloc.allocators.experiments.reproduction.protocol import Job

EXAMPLES = examples(
    "alloc reproduce paper --quick",
    "alloc reproduce paper --runs 100 --workers 8",
    closing="Runs that are in the folder are not repeated: the same command resumes after an interruption.",
)

QUICK_RUNS, QUICK_ITERATIONS = 2, 100

LOOK_S = 2.0
"""Seconds between two polls of how many runs have ended."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("reproduce", epilog=EXAMPLES)(reproduce_command)


def reproduce_command(
    folder: Annotated[str, typer.Argument(metavar="FOLDER", help="Output folder: rows, figures and reproduction.md.")],
    runs: Annotated[
        int | None, typer.Option(min=1, max=10_000, help="Runs of each method.", show_default="100")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="2 runs of 100 iterations instead of 300; takes minutes.")
    ] = False,
    methods: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Methods, separated by commas.", show_default="the paper's and baselines"),
    ] = None,
    iterations: Annotated[
        int | None, typer.Option(min=5, max=300, help="Iterations of each training.", show_default="300")
    ] = None,
    time_limit: Annotated[float, typer.Option(min=0.01, help="Seconds per run of methods that do not learn.")] = 1.0,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Parallel runs.", show_default="one per processor")
    ] = None,
    page: Annotated[
        bool, typer.Option("--page", help="Make no runs, only figures and page of those in the folder.")
    ] = False,
) -> None:
    """Repeat the paper's experiments.

    Five methods are trained from scratch in four scenarios; figures and a page show the results.
    """
    from alloc.allocators.experiments.reproduction.folder import Folder

    place = Folder(Path(folder))
    finished = True
    if not page:
        from alloc.allocators.experiments.reproduction.protocol import planned

        length = iterations or (QUICK_ITERATIONS if quick else 300)
        wanted = planned(runs or (QUICK_RUNS if quick else 100), _methods(methods), length, time_limit)
        finished = _made(place, wanted, workers)
    if finished or place.learned:
        place.publish()
        say(f"{place.page}: {counted(len({(row.run, row.method) for row in place.learned}), 'training')}")
    if not finished:
        note("interrupted; the same command resumes from here")
        raise typer.Exit(1)


def _methods(names: str | None) -> tuple[str, ...]:
    from alloc.allocators.experiments.reproduction.protocol import OTHERS, PAPER_METHODS, VARIANTS
    from alloc.problems import InputError
    from alloc.problems.errors import nearest

    if names is None:
        return (*PAPER_METHODS, *OTHERS)
    chosen = tuple(dict.fromkeys(name.strip() for name in names.split(",")))
    for name in chosen:
        if name not in VARIANTS and name not in OTHERS:
            raise InputError(f"unknown method {name!r}{nearest(name, (*VARIANTS, *OTHERS))}", "methods")
    return chosen


def _made(place: "Folder", wanted: "Sequence[Job]", workers: int | None) -> bool:
    """Make the missing runs until all are complete or a signal arrives; return whether they are complete."""
    from alloc.allocators.parallel.processes import ProcessEngine
    from alloc.allocators.runtime.interrupts import signals_set

    stop = threading.Event()
    progress = _Progress(place, wanted)
    with signals_set(stop), ProcessEngine(workers) as engine:
        return place.make(wanted, engine, lambda: progress.looked() or stop.is_set())


class _Progress:
    """Prints on a terminal how many runs have ended."""

    def __init__(self, place: "Folder", wanted: "Sequence[Job]") -> None:
        self._place, self._wanted, self._shows = place, wanted, is_terminal(sys.stderr)
        self._next, self._told = 0.0, -1

    def looked(self) -> bool:
        """Poll at most every `LOOK_S` seconds, print new results, and return False."""
        if self._shows and time.monotonic() >= self._next:
            self._next = time.monotonic() + LOOK_S
            done = len(self._wanted) - len(self._place.missing(self._wanted))
            if done != self._told:
                self._told = done
                say(f"{done} of {counted(len(self._wanted), 'run')} made")
        return False
