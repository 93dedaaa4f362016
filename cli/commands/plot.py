"""``alloc plot``."""

from typing import TYPE_CHECKING, Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import STANDARD, note
from alloc.cli.output.files import check_film, check_outputs, check_picture
from alloc.problems.text import counted

if TYPE_CHECKING:
    from alloc.allocators import Result
    from alloc.problems import Instance

EXAMPLES = examples(
    "alloc plot demo.json best.json --output best.png",
    "alloc plot demo.json best.json --output best.pdf",
    "alloc plot run.jsonl --output run.png",
    "alloc plot run.jsonl --output run.html",
    "alloc solve demo.json --json | alloc plot demo.json - --output demo.svg",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("plot", epilog=EXAMPLES)(plot_command)


def plot_command(
    instance: Annotated[
        str, typer.Argument(metavar="INSTANCE|LOG", help="An instance, or a log of `alloc simulate --log`.")
    ],
    output: Annotated[
        str,
        typer.Option(metavar="FILE", help="Picture to write: .png, .svg, .pdf; for a log also .html, .gif, .mp4."),
    ],
    result: Annotated[
        str | None,
        typer.Argument(metavar="RESULT", help=f"{options.PLAN}; - is standard input. Not for a log."),
    ] = None,
) -> None:
    """Draw a result, an allocation or the log of a mission.

    For a plan it shows places and flights, and when each task is done.
    """
    from alloc.allocators import plot
    from alloc.problems import InputError
    from alloc.problems.formats import read_instance

    check_outputs(("--output", output), read=[("INSTANCE", instance), ("RESULT", result)])
    if result is None:
        _draw_log(instance, output)
        return
    check_picture(output)
    if instance == result == STANDARD:
        raise InputError("cannot be the instance and the result at once", source="standard input")
    drawn = _read(result, read_instance(instance))
    plot(drawn, output)
    if drawn.evaluation is not None and drawn.evaluation.violations:
        count = counted(len(drawn.evaluation.violations), "agent")
        note(f"{count} cannot take the assigned task, which is drawn anyway; `alloc evaluate` says why")


def _draw_log(log: str, output: str) -> None:
    """Draw or animate the mission of a log."""
    from alloc.allocators.plotting import animate_mission, plot_mission
    from alloc.problems import InputError, course_of
    from alloc.problems.formats.files import named, read_text
    from alloc.problems.formats.messages import told
    from alloc.problems.missions.files.log_file import is_log, log_from_text

    is_film = output.lower().endswith((".html", ".gif", ".mp4"))
    (check_film if is_film else check_picture)(output)
    text = read_text(log)
    if not is_log(text):
        raise InputError("is not a log of a mission; to draw a plan, give the instance and the plan", source=named(log))
    try:
        course = course_of(log_from_text(text))
    except InputError as error:
        raise told(error, named(log)) from error
    (animate_mission if is_film else plot_mission)(course, output)


def _read(path: str, instance: "Instance") -> "Result":
    """Read a result, or read a plan and score it."""
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
