"""Output of the rows of a comparison: as JSON, as CSV, or as a table, and each row as soon as it is complete."""

import csv
import io
import sys
from collections.abc import Callable, Sequence

from alloc.cli.output.console import is_terminal, say, to_json
from alloc.cli.output.files import save


def show_done(outcome: str, count: int, total: int) -> None:
    """On a terminal, print the outcome of a row as soon as it is complete; the table follows at the end."""
    if is_terminal(sys.stderr):
        say(f"[{count}/{total}] {outcome}")


def write_rows(
    document: dict[str, object], columns: Sequence[str], file: str | None, tell: Callable[[], None], *, json: bool
) -> None:
    """Write a comparison to the requested outputs.

    Parameters
    ----------
    document : dict
        JSON document with a list of ``rows``.
    columns : sequence of str
        Columns of the CSV.
    file : str or None
        CSV file; ``-`` is standard output, in place of the table.
    tell : callable
        Prints the table; called unless the rows go to standard output.
    json : bool
        Whether to print the document to standard output.
    """
    from alloc.problems.formats import is_standard_output

    is_table_wanted = not json and not (file is not None and is_standard_output(file))
    shown = (lambda: to_json(document)) if json else None
    save(lambda: _csv(columns, document["rows"]), file, shown, [tell] if is_table_wanted else [])


def _csv(columns: Sequence[str], rows: object) -> str:
    """Return CSV with a header of the field names and a line per row; None becomes an empty cell."""
    assert isinstance(rows, list)
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
