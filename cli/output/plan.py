"""Tables of a plan for the terminal."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from alloc.cli.output.console import columns_of, table
from alloc.problems.text import number, short_names

if TYPE_CHECKING:
    from alloc.allocators import Result
    from alloc.allocators.plan.table import Column, Row, Value

MAX_ROWS = 50
"""Maximum number of rows of a table."""

MAX_NAMES = 6
"""Maximum number of agents of a group that are listed."""

LONGEST_NAME = 24
"""Maximum number of characters of a name."""


def plan_tables(result: "Result") -> list[str]:
    """Return a table by task and a table by agent, each of up to 50 rows; empty without an allocation."""
    import numpy as np

    from alloc.allocators.plan.table import agent_columns, agent_rows, task_columns, task_rows

    instance = result.instance
    if result.allocation is None:
        return []
    agents = agent_rows(result, np.arange(min(instance.n, MAX_ROWS)))
    tasks = task_rows(result, np.arange(min(instance.m, MAX_ROWS)))
    return [
        _table(task_columns(instance), tasks, instance.m, "tasks"),
        _table(agent_columns(instance), agents, instance.n, "agents"),
    ]


def _table(columns: "Sequence[Column[Row]]", rows: "Sequence[Row]", count: int, what: str) -> str:
    values = [[column.value(row) for row in rows] for column in columns]
    cells = [_cells(column) for column in values]
    lines = table([column.heading for column in columns], list(zip(*cells, strict=True)), left=_left(values))
    if count > len(rows):
        lines += f"\n... and {count - len(rows)} more {what}; --output with .csv, .xlsx or .html has all"
    return lines


def _cells(values: "list[Value]") -> list[str]:
    """Return the cells of a column, with different names shortened to different texts."""
    names = [value for value in values if isinstance(value, str)]
    short = dict(zip(names, short_names(names, LONGEST_NAME), strict=True))
    cells = [short[value] if isinstance(value, str) else _cell(value) for value in values]
    if not any(isinstance(value, tuple) for value in values):
        return cells
    width = max(map(columns_of, cells))
    return [cell + " " * (width - columns_of(cell)) for cell in cells]


def _cell(value: "float | tuple[str, ...] | None") -> str:
    if not isinstance(value, tuple):
        return number(value, 5)
    more = f" and {len(value) - MAX_NAMES} more" if len(value) > MAX_NAMES else ""
    return (", ".join(short_names(value[:MAX_NAMES], LONGEST_NAME)) + more) or "-"


def _left(values: "list[list[Value]]") -> int:
    """Return the number of leading columns with names."""
    return next((place for place, column in enumerate(values) if any(isinstance(one, float) for one in column)), 1)
