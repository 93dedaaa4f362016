"""Options of ``alloc compare``: of runs, outputs, and a store."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from alloc.allocators import Budget

SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([MG])i?B?", re.IGNORECASE)
"""Pattern of an amount of memory, such as 800M or 4G."""

MIN_MB = 100.0
"""Least memory in which a run can start."""


class Engine(StrEnum):
    """Engine that executes the runs of a comparison."""

    PROCESSES = "processes"
    RAY = "ray"


StoreOption = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="FILE",
        help="Store every run in this file and make only the missing ones, each in a process of its own, with one "
        "thread unless --threads says otherwise.",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Parallel runs, with --store.", show_default="as many as have own processors"),
]
MemoryOption = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory of a run with all its processes, such as 4G, with --store.",
        show_default="its share of 80 % of the machine's",
    ),
]
KillAfterOption = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="Kill a run after this many seconds, whatever its budget, with --store.",
        show_default="1.2 times the time limit and 10 s; none with --iterations",
    ),
]
RetryOption = Annotated[
    bool,
    typer.Option("--retry", help="Repeat runs that failed, were killed, hung or ran out of memory, with --store."),
]
ReportOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="FILE",
        help="Write tables and statistics as .md or .tex, or all runs as .csv or .parquet, with --store; may be "
        "repeated.",
    ),
]


EngineOption = Annotated[
    Engine | None,
    typer.Option(help="Where runs are executed, with --store.", show_default="processes on this machine"),
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        help="Address of the cluster, for --engine ray.", show_default="RAY_ADDRESS, else the cluster on this machine"
    ),
]


@dataclass(frozen=True)
class MethodRuns:
    """Runs of methods: on which instances, with which seeds, and how each is made."""

    sources: Sequence[str]
    seeds: Sequence[int]
    objective: str
    budget: "Budget"
    threads: int | None


@dataclass(frozen=True)
class Outputs:
    """Where the rows of a comparison go: to a CSV file, and as JSON to standard output."""

    csv: str | None
    json: bool

    def is_standard_output_taken(self) -> bool:
        """Return whether the rows go to standard output, so that no table is printed."""
        from alloc.problems.formats import is_standard_output

        return self.json or (self.csv is not None and is_standard_output(self.csv))


@dataclass(frozen=True)
class StoreOptions:
    """The store of a comparison and its options."""

    store: str
    workers: int | None
    memory_mb: float | None
    kill_after_s: float | None
    reports: tuple[str, ...]
    retry: bool
    engine: Engine
    address: str | None


def checked(
    store: str | None,
    workers: int | None,
    memory: str | None,
    kill_after: float | None,
    reports: list[str] | None,
    engine: Engine | None,
    address: str | None,
    *,
    retry: bool,
) -> StoreOptions | None:
    """Return the store with its options, None if there is none; raise an error for options that need one."""
    if store is None:
        given = {"workers": workers, "memory": memory, "kill-after": kill_after, "report": reports, "retry": retry}
        given |= {"engine": engine, "address": address}
        for name, value in given.items():
            if value not in (None, False):
                raise typer.BadParameter("can only be used with --store", param_hint=f"'--{name}'")
        return None
    if kill_after is not None and not kill_after > 0:
        raise typer.BadParameter("must be more than 0 seconds", param_hint="'--kill-after'")
    if address is not None and engine is not Engine.RAY:
        raise typer.BadParameter("can only be used with --engine ray", param_hint="'--address'")
    resources = (workers, _megabytes(memory), kill_after)
    return StoreOptions(store, *resources, tuple(reports or ()), retry, engine or Engine.PROCESSES, address)


def _megabytes(text: str | None) -> float | None:
    if text is None:
        return None
    found = SIZE.fullmatch(text.strip())
    if found is None:
        raise typer.BadParameter(f"must be an amount such as 800M or 4G, got {text!r}", param_hint="'--memory'")
    size = float(found[1]) * (1024 if found[2].upper() == "G" else 1)
    if size < MIN_MB:
        raise typer.BadParameter(f"must be at least {MIN_MB:g}M, or no run can start", param_hint="'--memory'")
    return size
