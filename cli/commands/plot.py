"""``alloc plot``."""

from typing import Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD
from alloc.cli.output.files import check_outputs, check_picture

EXAMPLES = examples(
    "alloc plot demo.json best.json --output best.png",
    "alloc solve demo.json --json | alloc plot demo.json - --output demo.svg",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("plot", epilog=EXAMPLES)(plot_command)


def plot_command(
    instance: options.InstanceArgument,
    result: Annotated[
        str, typer.Argument(metavar="RESULT", help="A result of `alloc solve` on it; - is standard input.")
    ],
    output: Annotated[str, typer.Option(metavar="FILE", help="Drawing to write: .png or .svg.")],
) -> None:
    """Draw a result: sites and moves, and when each task is done."""
    from alloc.allocators import plot, read_result
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    check_outputs(("--output", output), read=[("INSTANCE", instance), ("RESULT", result)])
    check_picture(output)
    if instance == result == STANDARD:
        raise InputError("cannot be the instance and the result at once", source="standard input")
    plot(read_result(result, read_instance(instance)), output)
