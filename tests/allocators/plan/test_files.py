"""A result as a file of each kind, and which kinds an instance rules out."""

import csv
import json
from pathlib import Path

import pytest
from openpyxl import load_workbook
from schema_checks import faults

from alloc.allocators import Result, read_result, write_result
from alloc.allocators.conclusion import scored_result
from alloc.allocators.plan.table import agent_rows
from alloc.problems import Allocation, InputError, Instance, MissingPackageError, Units


def earth(**more: object) -> Instance:
    """Three agents around the date line, and two tasks on either side of it."""
    fields: dict[str, object] = {
        "name": "dateline",
        "agent_ids": ["=A1+1", "east", "here"],
        "ability": [1, 2, 1],
        "workload": [2, 4],
        "agent_position": [[179, 10, 0], [-179, 10, 0], [-178, 12, 100]],
        "task_position": [[179.5, 12, 0], [-178, 12, 100]],
        "metric": "geographic",
        "units": Units(time="min"),
    }
    return Instance(**{**fields, **more})  # type: ignore[arg-type]


def planned(instance: Instance, plan: list[int]) -> Result:
    return scored_result(instance, Allocation(plan))


def test_csv_has_a_row_per_agent(tmp_path: Path) -> None:
    """The columns are the fields of a row; unknown values are empty."""
    result = planned(earth(), [0, 0, -1])
    write_result(result, tmp_path / "plan.csv")
    with open(tmp_path / "plan.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["agent"] for row in rows] == ["=A1+1", "east", "here"]
    assert [row["task"] for row in rows] == ["t1", "t1", ""]
    assert float(rows[0]["distance"]) == agent_rows(result)[0].distance


def test_workbook_has_three_sheets(tmp_path: Path) -> None:
    """Summary, tasks and agents; numbers are numbers, headings have units, and names are never formulas."""
    write_result(planned(earth(), [0, 0, -1]), tmp_path / "plan.xlsx")
    book = load_workbook(tmp_path / "plan.xlsx")
    assert book.sheetnames == ["summary", "tasks", "agents"]
    assert book["summary"]["A1"].value.startswith("dateline (3 agents, 2 tasks)")
    tasks = list(book["tasks"].values)
    assert tasks[0] == ("task", "workload", "finish (min)", "agents", "group")
    assert tasks[1] == ("t1", 2, pytest.approx(2 / 3), 2, "=A1+1, east")
    assert tasks[2] == ("t2", 4, "unserved", 0, None)
    name = book["agents"]["A2"]
    assert (name.value, name.data_type) == ("=A1+1", "s")


def test_geojson_has_points_and_moves(tmp_path: Path) -> None:
    """Tasks, agents and moves with their figures; moves across the date line are split there."""
    write_result(planned(earth(), [1, 1, 1]), tmp_path / "plan.geojson")
    document = json.loads((tmp_path / "plan.geojson").read_text())
    features = document["features"]
    assert [entry["properties"]["kind"] for entry in features] == ["task"] * 2 + ["agent"] * 3 + ["move"] * 2
    assert features[0]["geometry"] == {"type": "Point", "coordinates": [179.5, 12]}
    assert features[1]["geometry"]["coordinates"] == [-178, 12, 100]
    assert features[1]["properties"]["agents"] == ["=A1+1", "east", "here"]
    crossing, direct = features[5]["geometry"], features[6]["geometry"]
    assert crossing["type"] == "MultiLineString"
    (first, end), (begin, last) = crossing["coordinates"]
    assert (first, last) == ([179, 10], [-178, 12, 100])
    assert (end, begin) == ([180, pytest.approx(10 + 2 / 3)], [-180, pytest.approx(10 + 2 / 3)])
    assert direct == {"type": "LineString", "coordinates": [[-179, 10], [-178, 12, 100]]}
    assert document["units"] == {"time": "min"}


def test_json_is_read_back(tmp_path: Path) -> None:
    """The document is that of the result, with the units of the instance."""
    result = planned(earth(), [0, 1, 1])
    write_result(result, tmp_path / "plan.json")
    document = json.loads((tmp_path / "plan.json").read_text())
    assert document["units"] == {"time": "min"}
    assert faults(document) == []
    assert read_result(tmp_path / "plan.json", result.instance).to_dict() == result.to_dict()


@pytest.mark.parametrize(
    ("instance", "name", "message"),
    [
        (earth(), "plan.txt", "must end in .json, .csv, .xlsx, .geojson or .html"),
        (earth(), "plan", "must end in .json"),
        (earth(metric="euclidean"), "plan.geojson", "needs the metric 'geographic'"),
        (Instance(ability=[1], workload=[1]), "plan.html", "needs positions"),
        (Instance(ability=[1] * 20_001, workload=[1], task_position=[[0, 0]]), "plan.html", "at most 20000 agents"),
    ],
)
def test_unsupported_files_are_refused(tmp_path: Path, instance: Instance, name: str, message: str) -> None:
    """Another suffix, and a map without positions, are errors that name the file; no file is left behind."""
    with pytest.raises(InputError) as caught:
        write_result(planned(instance, [0] * instance.n), tmp_path / name)
    assert message in str(caught.value)
    assert name in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_workbook_needs_openpyxl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without openpyxl the error says what to install."""
    monkeypatch.setattr("alloc.allocators.plan.files.find_spec", lambda _: None)
    with pytest.raises(MissingPackageError, match=r"alloc-mrta\[tables\]"):
        write_result(planned(earth(), [0, 1, 1]), tmp_path / "plan.xlsx")
