"""Parsing of cells: booleans, lists of names, angles and coordinates."""

import re
from collections.abc import Iterable, Sequence

from alloc.problems.arguments import shown
from alloc.problems.tables.grid import Cell, as_text, is_real
from alloc.problems.tables.language.synonyms import NO, YES
from alloc.problems.tables.layout import Table

ANGLE = re.compile(
    r"([NSEW])?\s*([+-]?\d+(?:[.,]\d+)?)\s*(?:°|deg\b)?\s*(?:(\d+(?:[.,]\d+)?)\s*['′’]\s*)?"
    r"(?:(\d+(?:[.,]\d+)?)\s*(?:\"|″|''|”)\s*)?([NSEW])?(?![\w])",
    re.IGNORECASE,
)
MARKS = (";", "|", "\n", ",")
"""Separators of names, in order of preference."""


def flag(table: Table, row: int, column: int) -> bool:
    """Return a cell as a boolean; an empty cell is False."""
    cell = table.rows[row][column]
    text = as_text(cell).casefold()
    if isinstance(cell, bool):
        return cell
    if cell is None or text in NO:
        return False
    if text in YES:
        return True
    if re.search(r"\w", text):
        message = f"must be yes, no or the id of a base, got {shown(cell)}; give the bases with --bases"
        raise table.error(message, row, column)
    raise table.error(f"must be yes or no, got {shown(cell)}", row, column)


def separators(cells: Iterable[Cell]) -> str:
    """Return the separators of names in some cells; empty if names are separated by blanks."""
    texts = [cell for cell in cells if isinstance(cell, str)]
    return "".join(mark for mark in MARKS if any(mark in text for text in texts))


def names_in(cell: Cell, marks: str) -> list[str]:
    """Return the names in a cell, separated by any of `marks`, or by blanks if there are none."""
    if cell is None:
        return []
    if isinstance(cell, Sequence | set | frozenset) and not isinstance(cell, str):
        return [as_text(entry) for entry in cell]
    text = as_text(cell)
    if text[:1] + text[-1:] in ("[]", "{}", "()"):
        text = text[1:-1]
    parts = re.split(f"[{re.escape(marks)}]", text) if marks else text.split()
    return [part for part in (part.strip().strip("'\"") for part in parts) if part]


def angle(text: str) -> float | None:
    """Parse an angle in degrees, such as ``47.5``, ``47,5 N`` or ``8° 30' W``; None if it is not an angle."""
    match = ANGLE.fullmatch(text.strip())
    return None if match is None else _degrees(match)


def _degrees(match: "re.Match[str]") -> float:
    before, degrees, minutes, seconds, behind = match.groups()
    side = (before or behind or "").upper()
    parts = [float(part.replace(",", ".")) if part else 0.0 for part in (degrees, minutes, seconds)]
    value = abs(parts[0]) + parts[1] / 60 + parts[2] / 3600
    return -value if degrees.startswith("-") or side in ("S", "W") else value


def coordinates(cell: Cell) -> list[float] | None:
    """Parse two or three coordinates in a cell; None if it contains something else.

    With compass directions, latitude is returned first in any case.
    """
    if isinstance(cell, Sequence) and not isinstance(cell, str):
        return [float(one) for one in cell if is_real(one)] if len(cell) in (2, 3) and all(map(is_real, cell)) else None
    if not isinstance(cell, str):
        return None
    text = cell.strip().strip("()[]")
    if re.search(r"[°NSEW]", text, re.IGNORECASE):
        found = list(ANGLE.finditer(text))
        left = re.sub(ANGLE, "", text)
        if len(found) != 2 or left.strip(" ,;/|"):
            return None
        sides = [(match[1] or match[5] or "").upper() for match in found]
        values = [_degrees(match) for match in found]
        return values[::-1] if sides[0] in ("E", "W") else values
    parts = re.split(r"[;|/\s]+", re.sub(r",\s+", " ", text))
    if len(parts) == 1:
        parts = text.split(",")
    if len(parts) not in (2, 3) or not all(re.fullmatch(r"[+-]?\d+(?:[.,]\d+)?", part) for part in parts):
        return None
    return [float(part.replace(",", ".")) for part in parts]
