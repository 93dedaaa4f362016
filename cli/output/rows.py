"""The rows of a comparison: as JSON, as CSV, or as a table for people, and each as soon as it is known."""

import csv
import io
import sys
from collections.abc import Callable, Sequence

from alloc.cli.output.console import is_terminal, say, to_json
from alloc.cli.output.files import save


def show_done(outcome: str, count: int, total: int) -> None:
    """On a terminal, print the outcome of a row as soon as it is known; the table follows at the end."""
    if is_terminal(sys.stderr):
        say(f"[{count}/{total}] {outcome}")


def write_rows(
    document: dict[str, object], columns: Sequence[str], file: str | None, tell: Callable[[], None], *, json: bool
) -> None:
    """Write a comparison where it is wanted.

    Parameters
    ----------
    document : dict
        With a list of ``rows``.
    columns : sequence of str
        Those of the CSV.
    file : str or None
        For CSV; ``-`` is standard output, in place of the table.
    tell : callable
        Prints the table, unless standard output takes the rows.
    json : bool
        Print the document to standard output.
    """
    from alloc.problems.formats import is_standard_output

    is_table_wanted = not json and not (file is not None and is_standard_output(file))
    shown = (lambda: to_json(document)) if json else None
    save(lambda: _csv(columns, document["rows"]), file, shown, [tell] if is_table_wanted else [])


def _csv(columns: Sequence[str], rows: object) -> str:
    """Return a header with the names of the fields, and a line per row; None is empty."""
    assert isinstance(rows, list)
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
