"""Reports as files; the suffix of the file name determines the format."""

from collections.abc import Callable, Sequence
from pathlib import Path

from alloc.allocators.experiments.report.runs import require_pyarrow, runs_csv, runs_parquet
from alloc.allocators.experiments.report.table import Table
from alloc.allocators.experiments.stored import Comparison, Endings
from alloc.problems import InputError
from alloc.problems.formats import check_writable, write_bytes_atomically
from alloc.problems.formats.files import PathLike, is_stream, named

SUFFIXES = (".md", ".tex", ".csv", ".parquet")

SPECIAL = {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    **{letter: f"\\{letter}" for letter in "&%$#_{}"},
}
"""Special characters of LaTeX and their escapes."""


def check_report(path: PathLike) -> None:
    """Raise an error if a report cannot be written because of its suffix, a missing package, or its location."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES or is_stream(path):
        raise InputError(f"must end in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}", source=named(path, output=True))
    if suffix == ".parquet":
        require_pyarrow()
    check_writable(path)


def write_report(
    path: PathLike, comparison: Comparison, endings: Endings, tables: Callable[[], Sequence[Table]]
) -> None:
    """Write a report atomically.

    Parameters
    ----------
    path : str or path
        ``.md`` and ``.tex`` (with the package booktabs) contain tables and statistics, ``.csv`` and ``.parquet`` all
        runs.
    comparison : Comparison
    endings : mapping
        Endings of its runs.
    tables : callable
        Returns the tables, as `report_tables` and `mission_tables` do; called only if they are needed.

    Raises
    ------
    InputError
        If the suffix is unknown or the file cannot be written.
    MissingPackageError
        If pyarrow is needed and not installed.
    """
    check_report(path)
    suffix = Path(path).suffix.lower()
    if suffix == ".parquet":
        content = runs_parquet(comparison, endings)
    elif suffix == ".csv":
        content = runs_csv(comparison, endings).encode()
    else:
        render = markdown if suffix == ".md" else latex
        content = render(tables()).encode()
    write_bytes_atomically(path, content)


def markdown(tables: Sequence[Table]) -> str:
    """Return tables in Markdown, each with its title as a heading."""
    parts = []
    for table in tables:
        rule = ["---", *["--:"] * (len(table.header) - 1)]
        lines = ["| " + " | ".join(map(_cell, row)) + " |" for row in (table.header, rule, *table.rows)]
        parts.append("\n".join([f"## {table.title}", "", *lines, "", " ".join(table.notes)]).rstrip())
    return "\n\n".join(parts) + "\n"


def _cell(text: str) -> str:
    return text.replace("|", r"\|")


def latex(tables: Sequence[Table]) -> str:
    """Return tables in LaTeX with booktabs, each in a `table` environment with title and notes as its caption."""
    parts = ["% \\usepackage{booktabs}"]
    for table in tables:
        columns = "l" + "r" * (len(table.header) - 1)
        head, *body = (" & ".join(map(_escaped, row)) + r" \\" for row in (table.header, *table.rows))
        caption = _escaped(" ".join([f"{table.title}.", *table.notes]))
        lines = [r"\begin{table}", r"\centering", rf"\caption{{{caption}}}", rf"\begin{{tabular}}{{{columns}}}"]
        lines += [r"\toprule", head, r"\midrule", *body, r"\bottomrule", r"\end{tabular}", r"\end{table}"]
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _escaped(text: str) -> str:
    return "".join(SPECIAL.get(letter, letter) for letter in text)
