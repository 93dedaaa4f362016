"""``alloc replay``."""

from typing import Annotated

import typer

from alloc.cli import options
from alloc.cli.options import examples
from alloc.cli.output.console import say, write_json

EXAMPLES = examples(
    "alloc replay run.jsonl",
    "alloc replay run.jsonl --check",
    "alloc replay run.jsonl --json",
    closing="Exit code as of the run; 2 if the log is damaged or does not follow from its orders.",
)


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("replay", epilog=EXAMPLES)(replay_command)


def replay_command(
    log: Annotated[str, typer.Argument(metavar="LOG", help="A log of `alloc simulate --log`, - for standard input.")],
    check: Annotated[bool, typer.Option("--check", help="Print the conservation of work and energy.")] = False,
    json: options.JsonOption = False,
    quiet: options.QuietOption = False,
) -> None:
    """Simulate a mission again from the orders in its log.

    The figures must be the same.
    """
    from alloc.cli.output.mission import law_lines, lines
    from alloc.problems import InputError, read_log, replay
    from alloc.problems.formats.files import named
    from alloc.problems.formats.messages import told
    from alloc.problems.missions.files.document import mission_from_document

    recorded = read_log(log)
    try:
        result, laws = replay(recorded)
        units = mission_from_document(recorded.header["mission"]).instance.units
    except InputError as error:
        raise told(error, named(log)) from error
    if json:
        write_json(result.to_dict())
    elif not quiet:
        say(lines(result, units))
    if check and not quiet:
        say(law_lines(laws, units))
    raise typer.Exit(0 if result.is_done else 1)
