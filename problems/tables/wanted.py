"""Columns specified by the user, and the tables to which they belong."""

from collections.abc import Mapping
from typing import cast

from alloc.problems.errors import InputError, nearest
from alloc.problems.tables.grid import Grid, as_name
from alloc.problems.tables.language.headers import SYNONYMS, Kind

FIELDS = frozenset(name for synonyms in SYNONYMS.values() for name in synonyms)


class Wanted:
    """Columns specified by the user, for one table or for any table that has them."""

    def __init__(self, columns: Mapping[str, str]) -> None:
        self._columns = dict(columns)
        self._used: set[str] = set()
        for name in columns:
            kind, dot, field = name.rpartition(".")
            known = SYNONYMS.get(cast("Kind", kind), {}) if dot else FIELDS
            if field not in known:
                raise InputError(f"there is no field {name!r}{nearest(field, sorted(known or FIELDS))}", "columns")

    def of(self, kind: Kind, grid: Grid) -> dict[str, str]:
        """Return the specified columns of a table."""
        chosen: dict[str, str] = {}
        for name, text in self._columns.items():
            owner, dot, field = name.rpartition(".")
            if field not in SYNONYMS[kind] or (dot and owner != kind):
                continue
            if dot or self._is_only(field) or _has(grid, text):
                chosen[field] = text
                self._used.add(name)
        return chosen

    def _is_only(self, field: str) -> bool:
        """Return whether no other table has such a field."""
        return sum(field in synonyms for synonyms in SYNONYMS.values()) == 1

    def require_all_used(self) -> None:
        """Raise `InputError` for a specified column that no table has."""
        for name, text in self._columns.items():
            if name not in self._used:
                raise InputError(f"{name}={text}: no table has a column {text!r}", "columns")


def _has(grid: Grid, text: str) -> bool:
    return any(as_name(cell).casefold() == as_name(text).casefold() for row in grid.rows[:20] for cell in row)


def is_number(text: str) -> bool:
    """Return whether a text is a number instead of a column name."""
    try:
        float(text)
    except ValueError:
        return False
    return True
