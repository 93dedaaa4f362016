"""Arguments and options shared by several commands."""

import re
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from typing import Annotated

import typer
import typer.core

from alloc.problems.vocabulary import Objective

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
"""Methods for completion, which must not load numpy; a test compares them with the registry."""

BUILT_IN_POLICIES = (
    "idle",
    "random",
    "nearest",
    "greedy",
    "hedonic",
    "auction",
    "gappo",
    "ppo",
    "replan",
    "routes",
    "local-routes",
    "clairvoyant",
)
"""Policies for completion; see `BUILT_IN_METHODS`."""

READABLE = "a .json or .npz file, a folder with agents.csv and tasks.csv, or - for JSON on standard input"

BETWEEN_SETTINGS = re.compile(r",(?=\s*\w+=)")
"""A comma that separates parameters; other commas are part of a value."""

BETWEEN_METHODS = re.compile(r",(?![^\[]*\])")
"""A comma that separates methods, outside of brackets."""

PLAN = "A result of `alloc solve`, an allocation, a table of it, or a solver's solution of a model of `alloc export`"
"""Forms of a plan that every command with a plan as input reads."""


def examples(*lines: str, closing: str = "") -> str:
    """Return the text with examples below the help of a command."""
    parts = ["\b\nExamples:\n" + "\n".join(f"  {line}" for line in lines)]
    return "\n\n".join([*parts, closing] if closing else parts)


def complete_methods(incomplete: str) -> list[str]:
    """Return the completions of a method name, or of the last name in a list with commas."""
    from importlib.metadata import entry_points

    done, comma, last = incomplete.rpartition(",")
    names = [*BUILT_IN_METHODS, *(entry.name for entry in entry_points(group="alloc.allocators"))]
    return [done + comma + name for name in dict.fromkeys(names) if name.startswith(last)]


def complete_policies(incomplete: str) -> list[str]:
    """Return the completions of a policy name."""
    from importlib.metadata import entry_points

    names = [*BUILT_IN_POLICIES, *(entry.name for entry in entry_points(group="alloc.policies"))]
    return [name for name in dict.fromkeys(names) if name.startswith(incomplete)]


def complete_policy_list(incomplete: str) -> list[str]:
    """Return the completions of a policy name, or of the last name in a list with commas."""
    done, comma, last = incomplete.rpartition(",")
    return [done + comma + name for name in complete_policies(last)]


InstanceArgument = Annotated[str, typer.Argument(metavar="INSTANCE", help=f"The instance: {READABLE}.")]


class PlainObjective(StrEnum):
    """Objectives that do not need a plan in force."""

    MAKESPAN = Objective.MAKESPAN.value
    MAKESPAN_ENERGY = Objective.MAKESPAN_ENERGY.value


ObjectiveOption = Annotated[
    PlainObjective,
    typer.Option(help="What is minimised, after the number of unserved tasks: the makespan, then the energy."),
]
MethodOption = Annotated[
    str, typer.Option(autocompletion=complete_methods, help="A method from `alloc methods`; auto picks one.")
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option(help="Seconds per run.", show_default="10; none if --iterations is given"),
]
IterationsOption = Annotated[
    int | None, typer.Option(min=0, help="Iterations per run, in the method's own unit; reproducible on any machine.")
]
TargetGapOption = Annotated[float | None, typer.Option(help="Stop at this relative gap of the makespan; 0.01 is 1 %.")]
SeedOption = Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Random seed.")]
ThreadsOption = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Number of threads.", show_default="all processors; 1 with --iterations alone"),
]
PlotOption = Annotated[str | None, typer.Option(metavar="FILE", help="Draw the result as .png, .svg or .pdf.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON to standard output.")]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Print no summary, notes or progress.")]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME=VALUE", help="A parameter of the method; may be repeated."),
]


OPTION_NAMES = {
    "time_limit_s": "time_limit",
    "scenario": "family",
    "low": "ability_min",
    "high": "ability_max",
    "format": "file_format",
    "like": "add",
    "pins": "pin",
}
"""Option for each parameter of the library that has a different name."""


Parameter = typer.core.TyperArgument | typer.core.TyperOption


def option_of(place: str, parameters: Sequence[Parameter], arguments: Sequence[str] = ()) -> str:
    """Return the option or argument that sets the parameter `place` of the library, or else `place` itself.

    Options that take several values are in the plural: ``seed`` of `solve` is ``--seeds`` of ``alloc compare``.
    Parameters of a method are set by the ``--set`` among the `arguments` that names them, or by the list of methods
    that has them in brackets.
    """
    name = OPTION_NAMES.get(place, place)
    for known in (name, f"{name}s", f"{name.removesuffix('y')}ies"):
        for parameter in parameters:
            if parameter.name == known:
                is_option = isinstance(parameter, typer.core.TyperOption)
                return parameter.opts[0] if is_option else parameter.metavar or known.upper()
    if any(argument.removeprefix("--set=").startswith(f"{place}=") for argument in arguments):
        return f"--set {place}"
    in_brackets = re.compile(rf"\[(?:[^\]]*,)?\s*{re.escape(place)}=")
    for option, argument in pairwise(arguments):
        if option in ("--methods", "--policies") and in_brackets.search(argument):
            return f"{option}: {place}"
    return place


def time_limit(given: float | None, iterations: int | None) -> float | None:
    """Return the time limit: by default 10 s, or none if iterations are limited, so that runs are reproducible."""
    return 10.0 if given is None and iterations is None else given


def assignments(settings: Sequence[str] | None) -> dict[str, str]:
    """Return the names and values of ``--set NAME=VALUE``."""
    for setting in settings or ():
        if "=" not in setting:
            raise typer.BadParameter(f"must be NAME=VALUE, got {setting!r}", param_hint="'--set'")
    return dict(setting.split("=", 1) for setting in settings or ())


def values(settings: Sequence[str] | None) -> dict[str, object]:
    """Return the values of ``--set NAME=VALUE`` by name, as numbers, tuples of numbers, booleans, None or text."""
    return {name: value_of(text) for name, text in assignments(settings).items()}


def value_of(text: str) -> object:
    """Return the value of a text in Python's notation; values separated by commas become a tuple."""
    known = {"true": True, "false": False, "none": None}
    if text.lower() in known:
        return known[text.lower()]
    parts = [_number(part) for part in text.removesuffix(",").split(",")]
    if any(part is None for part in parts):
        return text
    return tuple(parts) if "," in text else parts[0]


def _number(text: str) -> int | float | None:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return None


def listed(text: str, option: str) -> dict[str, tuple[str, dict[str, object] | None]]:
    """Return the name and, if in brackets, the parameters of each method or policy, by its label in `text`."""
    found: dict[str, tuple[str, dict[str, object] | None]] = {}
    for label in dict.fromkeys(part.strip() for part in BETWEEN_METHODS.split(text) if part.strip()):
        name, bracket, settings = label.partition("[")
        if bracket and not settings.endswith("]"):
            raise typer.BadParameter(f"{label!r} must have the form ga[population=200]", param_hint=f"'{option}'")
        found[label] = (name, values(BETWEEN_SETTINGS.split(settings[:-1])) if bracket else None)
    if not found:
        such = "method, such as greedy" if option in ("--methods", "--load") else "policy, such as nearest"
        raise typer.BadParameter(f"names no {such}", param_hint=f"'{option}'")
    return found
