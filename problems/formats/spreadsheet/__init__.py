"""Spreadsheets as people keep them: text with any separator and encoding, and workbooks of Excel."""

from alloc.problems.formats.spreadsheet.file import read_grid

__all__ = ["read_grid"]
