"""Realistic spreadsheets are read correctly, or refused in one line."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from spreadsheets import TEXTS, WORKBOOKS, Case, workbook

from alloc.problems import InputError, Instance
from alloc.problems.formats.spreadsheet import read_grid
from alloc.problems.tables.grid import Grid


def imported(case: Case, folder: Path) -> tuple[Instance, list[str]]:
    """Return the instance of a case, and the lines about its columns, with file names without folders."""
    lines: list[str] = []
    *grids, bases = [None if path is None else read_grid(path) for path in case.write(folder)]
    instance = Instance.from_tables(*grids, report=lines.append, bases=bases, **case.options)
    return instance, [line.replace(f"{folder}/", "") for line in lines]


def found(instance: Instance, name: str) -> object:
    """Return a field of an instance in plain Python, None for NaN."""
    if name.startswith("units."):
        return getattr(instance.units, name.removeprefix("units."))
    table = instance.distances
    if name == "missing":
        return table.missing
    if name == "distances":
        ids = [*instance.agent_ids, *instance.task_ids, *instance.bases.ids]
        return [(ids[i], ids[j], d) for i, j, d in zip(table.source, table.target, table.distance, strict=True)]
    if name == "bases":
        return dict(zip(instance.bases.ids, instance.bases.position.tolist(), strict=True))
    value = getattr(instance, name)
    if name == "allowed_tasks":
        return [None if tasks is None else tasks.tolist() for tasks in value]
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype != np.float64:
        return value.tolist()
    return np.where(np.isnan(value), None, np.round(value, 9)).tolist()


def check(case: Case, folder: Path) -> None:
    """Check one spreadsheet against the expected instance or error."""
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
    """Each text file gives the expected fields, or one line that says what to correct."""
    check(case, tmp_path)


@pytest.mark.needs("openpyxl")
@pytest.mark.parametrize("case", WORKBOOKS, ids=lambda case: case.name)
def test_workbooks_are_imported_or_refused(case: Case, tmp_path: Path) -> None:
    """Workbooks with merged cells, titles and numbers converted to dates give the expected fields or errors."""
    check(case, tmp_path)


def test_there_are_enough_spreadsheets() -> None:
    """There are at least sixty spreadsheets, all different."""
    names = [case.name for case in [*TEXTS, *WORKBOOKS]]
    assert len(set(names)) == len(names) >= 60


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1", "cp1252"])
def test_separators_and_encodings_do_not_matter(encoding: str, tmp_path: Path) -> None:
    """The same fleet is read with any separator, encoding, decimal mark and line ends."""
    for separator in (";", "\t", ",", "|"):
        for mark in (",", "."):
            for end in ("\n", "\r\n", "\r"):
                number = f'"1{mark}5"' if separator == mark else f"1{mark}5"
                rows = [("Größe", "Nutzlast (kg)"), ("Jürgen", number), ("Zoë", "22")]
                text = end.join(separator.join(row) for row in rows) + end
                path = tmp_path / "agents.csv"
                path.write_bytes(text.encode(encoding))
                instance = Instance.from_tables(
                    read_grid(path), {"id": ["t1"], "load": [1]}, columns={"agents.id": "Größe"}
                )
                assert instance.agent_ids == ("Jürgen", "Zoë"), (separator, mark, end)
                assert instance.ability.tolist() == [1.5, 22]


FRAME = {"Drone": ["d1", "d2"], "Payload": [4, 2.5], "Range": [None, 12], "skills": [["a", "b"], None]}
ROWS = [{"Site": 1, "Load": "3,5", "needs": "B"}, {"Site": 2, "Load": 4}]


@pytest.mark.needs("pandas")
def test_data_frames_dicts_and_lists_of_dicts_are_accepted() -> None:
    """The same columns in either form give the same instance; an index with a name is a column."""
    import pandas as pd

    frame = pd.DataFrame(FRAME)
    for agents in (FRAME, frame, frame.set_index("Drone"), frame.to_dict("records")):
        instance = Instance.from_tables(agents, pd.DataFrame(ROWS))
        assert instance.agent_ids == ("d1", "d2")
        assert instance.ability.tolist() == [4, 2.5]
        assert instance.communication_range.tolist() == [float("inf"), 12]
        assert instance.skills == (("a", "b"), ())
        assert instance.task_ids == ("1", "2")
        assert instance.workload.tolist() == [3.5, 4]
        assert instance.needs == (("b",), ())


def test_distances_can_be_dicts() -> None:
    """Distances from Python, as rows and as a matrix."""
    agents, tasks = {"id": ["a"], "ability": [1]}, {"id": ["s", "t"], "workload": [1, 2]}
    rows = Instance.from_tables(agents, tasks, [{"from": "a", "to": "s", "distance": 3}])
    matrix = Instance.from_tables(agents, tasks, {"": ["a"], "s": [3], "t": [None]})
    for instance in (rows, matrix):
        assert found(instance, "distances") == [("a", "s", 3)]


@pytest.mark.parametrize(
    ("agents", "line"),
    [
        (3, "agents: must be a table: a data frame, a dict of columns or a list of dicts, got 3"),
        ([3], "agents[0]: must be a dict of columns' names and cells, got 3"),
        ({"id": ["a"], "ability": [1, 2]}, "agents: has columns of unequal length: {'id': 1, 'ability': 2}"),
        ({"id": ["a", "b"], "ability": [1, "x"]}, "agents: row 1, column 'ability': must be a number, got 'x'"),
        ({"id": ["a", "b"], "ability": [1, -1]}, "agents: row 1: must be a finite number > 0, got -1 (agent 'b')"),
    ],
)
def test_invalid_python_tables_are_refused(agents: object, line: str) -> None:
    """Errors for data from Python name the argument, the row and the column."""
    with pytest.raises(InputError) as raised:
        Instance.from_tables(agents, {"workload": [1]})
    assert str(raised.value) == line


def refusal(read: Callable[[], Grid]) -> str:
    """Return the error for a table of agents, empty if it is accepted."""
    try:
        Instance.from_tables(read(), {"workload": [1]})
    except InputError as error:
        return str(error)
    return ""


@given(st.binary(max_size=60), st.sampled_from(["", "id,ability\n", "id;ability;x;y\n1;2;"]))
def test_arbitrary_bytes_never_crash(tmp_path_factory: pytest.TempPathFactory, data: bytes, start: str) -> None:
    """Any bytes give an instance or a one-line error."""
    path = tmp_path_factory.getbasetemp() / "agents.csv"
    path.write_bytes(start.encode() + data)
    assert refusal(lambda: read_grid(path)).isprintable()


CELLS = ["1,5", "1.234", "x", "yes", "-", "8° 30' W", "a;b", "#REF!", "Total", "5 kg", "1 000", "", "1,2,3", "47.1, 8"]
HEADINGS = ["id", "ability", "Payload", "x", "y", "lat", "lon", "GPS", "Location", "speed [m/s]", "skills", "tasks"]


@given(
    st.lists(st.sampled_from(HEADINGS), min_size=1, max_size=5),
    st.lists(st.lists(st.sampled_from(CELLS), max_size=6), max_size=4),
)
def test_arbitrary_cells_never_crash(header: list[str], rows: list[list[str]]) -> None:
    """Any cells under known headers give an instance or a one-line error."""
    grid = Grid("agents.csv", [list(header), *[[cell or None for cell in row] for row in rows]], [*"01234"])
    assert refusal(lambda: grid).isprintable()


@pytest.mark.needs("openpyxl")
def test_sheet_is_selected_by_name_or_the_first(tmp_path: Path) -> None:
    """An unknown sheet is refused with the nearest one; the same table for agents and tasks is refused."""
    path = tmp_path / "fleet.xlsx"
    path.write_bytes(workbook([["id", "ability"], ["a", 1]], sheet="Drones"))
    with pytest.raises(InputError, match=r"has no sheet 'Drone' \(did you mean 'Drones'\?\)"):
        read_grid(f"{path}:Drone")
    with pytest.raises(InputError, match="cannot be both agents and tasks; name a sheet for each, or two files"):
        Instance.from_tables(read_grid(f"{path}:Drones"), read_grid(f"{path}:Drones"))
    assert read_grid(path).notes == ("the first of 2 sheets, 'Sheet', was read",)


@pytest.mark.needs("openpyxl")
def test_hidden_rows_are_reported(tmp_path: Path) -> None:
    """Rows hidden by a filter are read, with a note; files that are not workbooks are refused."""
    from openpyxl import load_workbook

    path = tmp_path / "fleet.xlsx"
    path.write_bytes(workbook([["id", "ability"], ["a", 1], ["b", 2]]))
    book = load_workbook(path)
    book.active.row_dimensions[3].hidden = True
    book.save(path)
    assert read_grid(path).notes == ("1 hidden rows were read too",)
    path.write_bytes(b"PK nothing")
    with pytest.raises(InputError, match="is not a readable workbook"):
        read_grid(path)
