"""``alloc report``."""

import sys
import time
from typing import Annotated

import typer

from alloc.cli.options import examples
from alloc.cli.output.console import is_terminal, note, say
from alloc.cli.output.files import check_outputs

EXAMPLES = examples(
    "alloc report runs.db --output report.html",
    "alloc report monday.db tuesday.db --against greedy --title 'Paper scenarios' -o report.html",
)

EVERY_S = 1.0
"""Least seconds between two lines of progress."""


def register(app: typer.Typer) -> None:
    """Add the command to `app`."""
    app.command("report", epilog=EXAMPLES)(report_command)


def report_command(
    stores: Annotated[list[str], typer.Argument(metavar="STORE...", help="Files of `alloc compare --store`.")],
    output: Annotated[
        str,
        typer.Option("--output", "-o", metavar="FILE", help="Page to write, a self-contained .html file."),
    ],
    against: Annotated[
        str | None,
        typer.Option(
            metavar="METHOD",
            help="Compare all methods with this one, written as in ga[population=200].",
            show_default="all pairs if they are few, else with the first",
        ),
    ] = None,
    title: Annotated[
        str | None, typer.Option(help="Heading of the page.", show_default="the names of the stores")
    ] = None,
) -> None:
    """Write a report of stored runs as one page.

    It contains tables, statistics, charts, failures, and maps of the plans.
    """
    from alloc.allocators import report_html
    from alloc.problems.formats import is_standard_output
    from alloc.problems.text import counted

    check_outputs(("--output", output), read=[("STORE", store) for store in stores])
    count = report_html(stores, output, title=title, against=against, progress=_Progress().tell)
    if not count:
        note(f"there are no runs in {', '.join(stores)}: {output} is empty")
    elif not is_standard_output(output):
        say(f"wrote {output}: {counted(count, 'run')}")


class _Progress:
    """Prints progress on a terminal, at most once a second."""

    def __init__(self) -> None:
        self._shows, self._told_at = is_terminal(sys.stderr), time.monotonic()

    def tell(self, words: str) -> None:
        """Print a line of progress, unless one was printed less than `EVERY_S` ago."""
        if self._shows and time.monotonic() - self._told_at >= EVERY_S:
            self._told_at = time.monotonic()
            say(words)
