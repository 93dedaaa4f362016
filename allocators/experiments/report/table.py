"""A table of a report, independent of its output format."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """A table with a title and notes.

    Attributes
    ----------
    title : str
    header : list of str
        The first column is text, all others are numbers.
    rows : list of list of str
    notes : list of str
    """

    title: str
    header: list[str]
    rows: list[list[str]]
    notes: list[str]
