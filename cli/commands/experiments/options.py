"""Options of a comparison that is kept in a store."""

import re
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import typer

SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([MG])i?B?", re.IGNORECASE)
"""An amount of memory, such as 800M or 4G."""

LEAST_MB = 100.0
"""Memory below which no run starts."""


class Engine(StrEnum):
    """Where the runs of a comparison are made."""

    PROCESSES = "processes"
    RAY = "ray"


StoreOption = Annotated[
    str | None,
    typer.Option(
        "--store",
        metavar="FILE",
        help="Keep every run in this file, each made in a process of its own, with one thread unless --threads says "
        "otherwise, and make only those that it has not yet.",
    ),
]
WorkersOption = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Runs at a time, with --store.", show_default="as many as have own processors"),
]
MemoryOption = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory of a run with all that it starts, such as 4G, with --store.",
        show_default="its part of 80 % of the machine's",
    ),
]
KillAfterOption = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        help="End a run that takes longer, whatever its budget, with --store.",
        show_default="1.2 times the time limit and 10 s; none with --iterations",
    ),
]
RetryOption = Annotated[
    bool,
    typer.Option("--retry", help="Run again what failed, was killed, hung or ran out of memory, with --store."),
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
    typer.Option(help="Where runs are made, with --store.", show_default="processes of this machine"),
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        help="For --engine ray: head of the cluster.", show_default="RAY_ADDRESS, else the cluster on this machine"
    ),
]


@dataclass(frozen=True)
class Keeping:
    """The store of a comparison, and what goes with it."""

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
) -> Keeping | None:
    """Return the options of a store, None where there is none; raise an error for those that need one."""
    if store is None:
        given = {"workers": workers, "memory": memory, "kill-after": kill_after, "report": reports, "retry": retry}
        given |= {"engine": engine, "address": address}
        for name, value in given.items():
            if value not in (None, False):
                raise typer.BadParameter("goes with --store only", param_hint=f"'--{name}'")
        return None
    if kill_after is not None and not kill_after > 0:
        raise typer.BadParameter("must be more than 0 seconds", param_hint="'--kill-after'")
    if address is not None and engine is not Engine.RAY:
        raise typer.BadParameter("goes with --engine ray only", param_hint="'--address'")
    means = (workers, _megabytes(memory), kill_after)
    return Keeping(store, *means, tuple(reports or ()), retry, engine or Engine.PROCESSES, address)


def _megabytes(text: str | None) -> float | None:
    if text is None:
        return None
    found = SIZE.fullmatch(text.strip())
    if found is None:
        raise typer.BadParameter(f"{text!r} is not like 800M or 4G", param_hint="'--memory'")
    size = float(found[1]) * (1024 if found[2].upper() == "G" else 1)
    if size < LEAST_MB:
        raise typer.BadParameter(f"must be at least {LEAST_MB:g}M, or no run starts", param_hint="'--memory'")
    return size
