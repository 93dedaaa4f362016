"""Reading of spreadsheets: text with any common separator and encoding, and Excel workbooks."""

from alloc.problems.formats.spreadsheet.file import read_grid

__all__ = ["read_grid"]
