"""A table of a report, before it is known what it is printed as."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """A table with a title, and notes that belong to it.

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
