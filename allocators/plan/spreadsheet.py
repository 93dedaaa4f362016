"""A plan as CSV for programs, and as a workbook for people."""

import csv
import io
from dataclasses import fields
from typing import TYPE_CHECKING

from alloc.allocators.plan.table import (
    AgentRow,
    Column,
    Row,
    Value,
    agent_columns,
    agent_rows,
    task_columns,
    task_rows,
)
from alloc.problems.text import number, one_line

if TYPE_CHECKING:
    from openpyxl.worksheet._write_only import WriteOnlyWorksheet

    from alloc.allocators.result import Result

MAX_ROWS = 1_048_576
"""Maximum number of rows of a sheet."""

LONGEST_CELL = 32_767
"""Maximum number of characters of a cell."""


def to_csv(result: "Result") -> str:
    """Return a header with the fields of `AgentRow`, and a line per agent; None becomes an empty field."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [field.name for field in fields(AgentRow)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(map(vars, agent_rows(result)))
    return text.getvalue()


def to_workbook(result: "Result") -> bytes:
    """Return a workbook with the sheets summary, tasks and agents; headings include units."""
    from openpyxl import Workbook

    book = Workbook(write_only=True)
    summary = book.create_sheet("summary")
    summary.column_dimensions["A"].width = 120
    for line in [*str(result).splitlines(), *result.notes]:
        summary.append([_cell(summary, line)])
    extra = [Column[AgentRow]("cannot go because", lambda row: row.violation)] if _has_violations(result) else []
    _fill(book.create_sheet("tasks"), task_columns(result.instance), task_rows(result))
    _fill(book.create_sheet("agents"), [*agent_columns(result.instance), *extra], agent_rows(result))
    book.properties.title = one_line(result.instance.name)
    written = io.BytesIO()
    book.save(written)
    return written.getvalue()


def _has_violations(result: "Result") -> bool:
    return result.evaluation is not None and bool(result.evaluation.violations)


def _fill(sheet: "WriteOnlyWorksheet", columns: list[Column[Row]], rows: list[Row]) -> None:
    """Write a frozen heading with filters, and the rows below it."""
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    sheet.freeze_panes = "B2"
    last = get_column_letter(len(columns))
    sheet.auto_filter.ref = f"A1:{last}{len(rows) + 1}"
    for place, column in enumerate(columns, 1):
        longest = max((len(_shown(column.value(row))) for row in rows[:1000]), default=0)
        sheet.column_dimensions[get_column_letter(place)].width = min(max(longest, len(column.heading)) + 3, 60)
    headings = [WriteOnlyCell(sheet, value=column.heading) for column in columns]
    for cell in headings:
        cell.font = Font(bold=True)
    sheet.append(headings)
    for row in rows:
        sheet.append([_cell(sheet, column.value(row)) for column in columns])


def _cell(sheet: "WriteOnlyWorksheet", value: Value) -> object:
    """Return a value as a cell; text that begins with = remains text and is not a formula."""
    if value is None or isinstance(value, float):
        return value
    from openpyxl.cell import WriteOnlyCell

    cell = WriteOnlyCell(sheet, value=_shown(value)[: LONGEST_CELL - 1])
    cell.data_type = "s"
    return cell


def _shown(value: Value) -> str:
    if isinstance(value, tuple):
        value = ", ".join(value)
    return number(value) if isinstance(value, float) else one_line(value or "")
