"""Arguments and options that several commands share."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Annotated

import typer
import typer.core

BUILT_IN_METHODS = (
    "auto",
    "greedy",
    "local-search",
    "milp",
    "cpsat",
    "ga",
    "hedonic",
    "auction",
    "lp-round",
    "gappo",
    "gappo-ls",
    "ppo",
    "a2c",
    "dqn",
    "ddpg",
)
"""For completion alone, which must not wait for numpy; a test compares them with the registry."""

READABLE = "a .json or .npz file, a folder with agents.csv and tasks.csv, or - for JSON on standard input"


class Objective(StrEnum):
    """As `alloc.problems.Objective`, without numpy; a test compares the two."""

    MAKESPAN = "makespan"
    MAKESPAN_ENERGY = "makespan-energy"


def examples(*lines: str, closing: str = "") -> str:
    """Return the examples of a command, as they stand under its help."""
    parts = ["\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)]
    return "\n\n".join([*parts, closing] if closing else parts)


def complete_methods(incomplete: str) -> list[str]:
    """Return the methods that begin with `incomplete`, or continue its list after a comma."""
    from importlib.metadata import entry_points

    done, comma, last = incomplete.rpartition(",")
    names = [*BUILT_IN_METHODS, *(entry.name for entry in entry_points(group="alloc.allocators"))]
    return [done + comma + name for name in dict.fromkeys(names) if name.startswith(last)]


InstanceArgument = Annotated[str, typer.Argument(metavar="INSTANCE", help=f"The instance: {READABLE}.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON to standard output.")]
ObjectiveOption = Annotated[
    Objective,
    typer.Option(help="What counts after the number of unserved tasks; the second one also counts energy."),
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option(min=0, help="Seconds for one run.", show_default="10; none where --iterations is given"),
]
IterationsOption = Annotated[
    int | None, typer.Option(min=0, help="Iterations of one run, in the method's own unit: the same on any machine.")
]
TargetGapOption = Annotated[
    float | None, typer.Option(min=0, help="Stop at this relative gap of the makespan; 0.01 is 1 %.")
]
ThreadsOption = Annotated[int | None, typer.Option(min=1, max=1024, help="Threads.", show_default="all processors")]


RENAMED = {
    "time_limit_s": "time_limit",
    "scenario": "family",
    "low": "ability_min",
    "high": "ability_max",
}
"""Parameters of the library whose option has another name than themselves."""


def option_of(place: str, parameters: Sequence[typer.core.TyperArgument | typer.core.TyperOption]) -> str:
    """Return what a command calls the parameter that the library names: an option, an argument, or `place` itself.

    A command that takes several of them has the plural: ``seed`` of `solve` is ``--seeds`` of ``alloc compare``.
    """
    name = RENAMED.get(place, place)
    for known in (name, f"{name}s"):
        for parameter in parameters:
            if parameter.name == known:
                is_option = isinstance(parameter, typer.core.TyperOption)
                return parameter.opts[0] if is_option else parameter.metavar or known.upper()
    return place


def time_limit(given: float | None, iterations: int | None) -> float | None:
    """Return the time limit: 10 s, unless iterations are counted, which makes runs reproducible."""
    return 10.0 if given is None and iterations is None else given
