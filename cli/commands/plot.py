"""``alloc plot``."""

from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, note
from alloc.cli.output.files import check_outputs, check_picture
from alloc.problems.text import counted

if TYPE_CHECKING:
    from alloc.allocators import Result
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc plot demo.json best.json --output best.png",
    "alloc plot demo.json best.json --output best.pdf",
    "alloc solve demo.json --json | alloc plot demo.json - --output demo.svg",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("plot", epilog=EXAMPLES)(plot_command)


def plot_command(
    instance: options.InstanceArgument,
    result: Annotated[
        str,
        typer.Argument(metavar="RESULT", help=f"{options.PLAN}; - is standard input."),
    ],
    output: Annotated[str, typer.Option(metavar="FILE", help="Drawing to write: .png, .svg or .pdf.")],
) -> None:
    """Draw a stored result or allocation: sites and moves, and when each task is done."""
    from alloc.allocators import plot
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    check_outputs(("--output", output), read=[("INSTANCE", instance), ("RESULT", result)])
    check_picture(output)
    if instance == result == STANDARD:
        raise InputError("cannot be the instance and the result at once", source="standard input")
    drawn = _read(result, read_instance(instance))
    plot(drawn, output)
    if drawn.evaluation is not None and drawn.evaluation.violations:
        count = counted(len(drawn.evaluation.violations), "agent")
        note(f"{count} cannot take the task given, and drawn there all the same; `alloc evaluate` says why")


def _read(path: str, instance: "Instance") -> "Result":
    """Read a result, or score a plan."""
    from alloc.allocators import Result
    from alloc.allocators.conclusion import scored_result
    from alloc.problems import InputError
    from alloc.problems.formats import read_plan
    from alloc.problems.formats.messages import told

    plan = read_plan(path, instance)
    if not plan.result:
        allocation, warning = plan.allocation(instance)
        if warning is not None:
            note(warning)
        return scored_result(instance, allocation)
    try:
        return Result.from_dict(plan.result, instance)
    except InputError as error:
        raise told(error, plan.source) from error.__cause__
