"""``alloc convert``."""

from typing import Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples

EXAMPLES = examples(
    "alloc convert demo.json demo.npz",
    "alloc convert demo.npz demo-tables",
    "alloc convert demo-tables - | alloc solve -",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("convert", epilog=EXAMPLES)(convert_command)


def convert_command(
    source: options.InstanceArgument,
    target: Annotated[
        str,
        typer.Argument(metavar="TARGET", help="Output: .json, .npz, a folder (no suffix) for CSV, or - for JSON."),
    ],
) -> None:
    """Convert an instance to another format.

    The suffix determines the format.
    """
    from alloc.problems.formats import read_instance, write_instance

    write_instance(read_instance(source), target)
