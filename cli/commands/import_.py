"""``alloc import``."""

import re
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, say
from alloc.cli.output.files import check_outputs
from alloc.problems.text import counted, one_line

if TYPE_CHECKING:
    from alloc.problems import Units

EXAMPLES = examples(
    "alloc import --agents drones.csv --tasks sites.xlsx --output fleet.json",
    "alloc import --agents fleet.xlsx:Drones --tasks fleet.xlsx:Sites --output fleet.json",
    "alloc import --agents crews.csv --tasks jobs.csv --map ability=Rate,tasks.id=Job --output fleet.json",
    closing="The interpretation of each column is printed. Exit code 2 if a table is ambiguous or cannot be read.",
)

TABLE = "text with any separator, .xlsx, or .xlsx:SHEET"


class Decimal(StrEnum):
    """The decimal mark."""

    POINT = "point"
    COMMA = "comma"


class Missing(StrEnum):
    """Treatment of pairs without a given distance."""

    METRIC = "metric"
    UNREACHABLE = "unreachable"


MapOption = Annotated[
    list[str] | None,
    typer.Option(
        "--map",
        metavar="FIELD=COLUMN,...",
        help="Column of a field, or a number for all rows; tasks.id=Job applies to one table only. May be repeated.",
    ),
]
UnitsOption = Annotated[
    str | None,
    typer.Option(metavar="QUANTITY=UNIT,...", help="Units of time, distance, energy and work not given in headers."),
]


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("import", epilog=EXAMPLES)(import_command)


def import_command(
    agents: Annotated[str, typer.Option(metavar="FILE", help=f"Table of agents: {TABLE}.")],
    tasks: Annotated[str, typer.Option(metavar="FILE", help="Table of tasks.")],
    output: Annotated[str, typer.Option(metavar="FILE", help="Instance to write: .json, .npz, a folder, or -.")],
    distances: Annotated[
        str | None, typer.Option(metavar="FILE", help="Table with columns from, to and distance, or a matrix.")
    ] = None,
    bases: Annotated[
        str | None, typer.Option(metavar="FILE", help="Table of the bases to which agents return: ids and places.")
    ] = None,
    columns: MapOption = None,
    units: UnitsOption = None,
    decimal: Annotated[Decimal | None, typer.Option(help="The decimal mark, if the numbers leave it open.")] = None,
    missing: Annotated[
        Missing | None,
        typer.Option(
            help="Pairs without a given distance: computed by the metric, or unreachable.",
            show_default="metric if all have places",
        ),
    ] = None,
    quiet: options.QuietOption = False,
) -> None:
    """Import an instance from spreadsheets of agents and tasks.

    Columns are recognised by their headers; the interpretation of each is printed.
    """
    from alloc.problems import Instance
    from alloc.problems.formats import write_instance
    from alloc.problems.formats.spreadsheet import read_grid

    read = [("--agents", _file(agents)), ("--tasks", _file(tasks))]
    others = {"--distances": distances, "--bases": bases}
    read += [(option, _file(name)) for option, name in others.items() if name is not None]
    check_outputs(("--output", output), read=read)
    instance = Instance.from_tables(
        read_grid(agents),
        read_grid(tasks),
        None if distances is None else read_grid(distances),
        columns=_pairs(columns, "--map"),
        units=_units(units),
        decimal=decimal,
        missing=missing,
        name=Path(agents if output == STANDARD else output).stem or "instance",
        report=_silent if quiet else _say,
        bases=None if bases is None else read_grid(bases),
    )
    write_instance(instance, output)
    if not quiet and output != STANDARD:
        say(f"wrote {output}: {counted(instance.n, 'agent')}, {counted(instance.m, 'task')}")


def _say(line: str) -> None:
    say(one_line(line))


def _silent(line: str) -> None:
    """Discard a line."""


def _file(name: str) -> str:
    """Return the file name of a table, without the sheet."""
    return re.sub(r"(?i)(\.xls[xm]):.*", r"\1", name)


def _pairs(given: list[str] | None, option: str) -> dict[str, str]:
    """Return names and values of ``NAME=VALUE,NAME=VALUE``; values may contain commas."""
    parts = [part for text in given or () for part in re.split(r",(?=\s*[\w.]+\s*=)", text)]
    pairs: dict[str, str] = {}
    for part in parts:
        name, equals, value = part.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise typer.BadParameter(f"must be NAME=VALUE, got {part!r}", param_hint=f"'{option}'")
        if name.strip() in pairs:
            raise typer.BadParameter(f"{name.strip()!r} is given twice", param_hint=f"'{option}'")
        pairs[name.strip()] = value.strip().strip("'\"")
    return pairs


def _units(given: str | None) -> "Units | None":
    from alloc.problems import InputError, Units
    from alloc.problems.errors import nearest

    if given is None:
        return None
    pairs = _pairs([given], "--units")
    known = ("time", "distance", "energy", "work")
    for name in pairs:
        if name not in known:
            raise InputError(f"there is no quantity {name!r}{nearest(name, known)}", "units")
    return Units(**pairs)
