"""Spreadsheets as people write them are read rightly, or refused in one line."""

from pathlib import Path

import numpy as np
import pytest
from spreadsheets import TEXTS, WORKBOOKS, Case

from alloc.problems import InputError, Instance
from alloc.problems.formats.spreadsheet import read_grid


def imported(case: Case, folder: Path) -> tuple[Instance, list[str]]:
    """Return the instance of a case, and the lines about its columns, files by their names alone."""
    lines: list[str] = []
    grids = [None if path is None else read_grid(path) for path in case.write(folder)]
    instance = Instance.from_tables(*grids, report=lines.append, **case.options)
    return instance, [line.replace(f"{folder}/", "") for line in lines]


def found(instance: Instance, name: str) -> object:
    """Return a field of an instance in plain Python, None for NaN."""
    if name.startswith("units."):
        return getattr(instance.units, name.removeprefix("units."))
    table = instance.distances
    if name == "missing":
        return table.missing
    if name == "distances":
        ids = [*instance.agent_ids, *instance.task_ids]
        return [(ids[i], ids[j], d) for i, j, d in zip(table.source, table.target, table.distance, strict=True)]
    value = getattr(instance, name)
    if name == "allowed_tasks":
        return [None if tasks is None else tasks.tolist() for tasks in value]
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype != np.float64:
        return value.tolist()
    return np.where(np.isnan(value), None, np.round(value, 9)).tolist()


def check(case: Case, folder: Path) -> None:
    """Check one spreadsheet against what must come of it."""
    if case.error:
        with pytest.raises(InputError) as raised:
            imported(case, folder)
        assert str(raised.value).replace(f"{folder}/", "") == case.error
        return
    instance, lines = imported(case, folder)
    assert {name: found(instance, name) for name in case.fields} == case.fields
    assert set(case.lines) <= set(lines), lines


@pytest.mark.parametrize("case", TEXTS, ids=lambda case: case.name)
def test_text_is_imported_or_refused(case: Case, tmp_path: Path) -> None:
    """Each text file gives the fields that a person would read from it, or one line that says what to mend."""
    check(case, tmp_path)


@pytest.mark.needs("openpyxl")
@pytest.mark.parametrize("case", WORKBOOKS, ids=lambda case: case.name)
def test_workbooks_are_imported_or_refused(case: Case, tmp_path: Path) -> None:
    """The same of workbooks, with merged cells, titles and numbers that became dates."""
    check(case, tmp_path)


def test_there_are_spreadsheets_enough() -> None:
    """Sixty spreadsheets at the least, and none twice."""
    names = [case.name for case in [*TEXTS, *WORKBOOKS]]
    assert len(set(names)) == len(names) >= 60
