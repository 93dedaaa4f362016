"""Each error in a folder of tables is one line with folder, file, line, column and correction."""

import json
import os
from pathlib import Path

import pytest

from .conftest import the_error


def header(**fields: object) -> str:
    """Return an instance.json with some fields."""
    return json.dumps({"format": "alloc-instance/1", **fields})


TABLES: list[tuple[dict[str, str | bytes], str, str]] = [
    ({"agents.csv": ""}, "agents.csv", "is empty; its first line must name the columns: id,ability"),
    ({"agents.csv": "\n\n"}, "agents.csv", "is empty"),
    ({"agents.csv": "id,ability\n"}, "agents.csv", "at least one agent"),
    ({"tasks.csv": "id,workload\n"}, "tasks.csv", "at least one agent and one task"),
    ({"agents.csv": "id;ability\na;1\n"}, "agents.csv line 1", "separate columns by commas"),
    ({"agents.csv": "id,abilty\na,1\n"}, "agents.csv line 1", "unknown column 'abilty' (did you mean 'ability'?)"),
    ({"agents.csv": "ID,ability\na,1\n"}, "agents.csv line 1", "unknown column 'ID' (did you mean 'id'?)"),
    ({"tasks.csv": "id,WorkLoad\na,1\n"}, "tasks.csv line 1", "unknown column 'WorkLoad' (did you mean 'workload'?)"),
    ({"agents.csv": ",,\n , \n"}, "agents.csv", "is empty"),
    ({"agents.csv": "id,ability\n,,\n\nb,four\n"}, "agents.csv line 4, column ability", "must be a number, got 'four'"),
    ({"agents.csv": "id,ability\n,4\n"}, "agents.csv line 2, column id", ""),
    ({"agents.csv": "id\na\n"}, "agents.csv line 1", "the column 'ability' is missing"),
    ({"tasks.csv": "workload\n3\n"}, "tasks.csv line 1", "the column 'id' is missing"),
    ({"agents.csv": "id,ability,id\na,1,b\n"}, "agents.csv line 1", "the column 'id' occurs twice"),
    ({"agents.csv": "a1,4\na2,5\n"}, "agents.csv line 1", "unknown column 'a1'"),
    ({"agents.csv": "id,ability\na,1\nb\n"}, "agents.csv line 3", "has 1 cell, but there are 2 columns"),
    ({"agents.csv": "id,ability\na,1,2\n"}, "agents.csv line 2", "has 3 cells, but there are 2 columns"),
    ({"agents.csv": 'id,ability\n"a,1\n'}, "agents.csv line 2", "is not CSV: unexpected end of data"),
    ({"agents.csv": 'id,ability\n"a"b,1\n'}, "agents.csv line 2", "is not CSV"),
    ({"agents.csv": f"id,ability\n{'a' * 200_000},1\n"}, "agents.csv line 2", "field larger than field limit"),
    ({"agents.csv": b"id,ability\nZo\xeb,1\n"}, "agents.csv line 2", "is not UTF-8 (byte 0xeb); save it as UTF-8"),
    (
        {"agents.csv": "id,ability\na,1\n\nb,four\n"},
        "agents.csv line 4, column ability",
        "must be a number, got 'four'",
    ),
    ({"agents.csv": 'id,ability\n"a\nb",1\nc,x\n'}, "agents.csv line 4, column ability", "must be a number, got 'x'"),
    ({"agents.csv": "id,ability\na,\n"}, "agents.csv line 2, column ability", "is missing"),
    ({"agents.csv": "id,ability\na,nan\n"}, "agents.csv line 2, column ability", "must be a number, got 'nan'"),
    ({"agents.csv": "id,ability\na,1e999\n"}, "agents.csv line 2, column ability", "must be a number, got '1e999'"),
    ({"agents.csv": "id,ability\na,1_000\n"}, "agents.csv line 2, column ability", "must be a number, got '1_000'"),
    ({"agents.csv": "id,ability\na,٣\n"}, "agents.csv line 2, column ability", "must be a number, got '٣'"),
    ({"agents.csv": "id,ability\na,0\n"}, "agents.csv line 2, column ability", "must be a finite number > 0, got 0"),
    ({"agents.csv": "id,ability\n,1\n"}, "agents.csv line 2, column id", "must be a non-empty string"),
    ({"agents.csv": "id,ability\na,1\na,1\n"}, "agents.csv line 3, column id", "'a' is used twice"),
    ({"agents.csv": "id,ability\na\0,1\n"}, "agents.csv line 2, column id", "without NUL"),
    ({"agents.csv": "id,ability,range\na,1,inf\n"}, "agents.csv line 2, column range", "must be a number, got 'inf'"),
    ({"agents.csv": "id,ability,speed\na,1,0\n"}, "agents.csv line 2, column speed", "must be a number > 0"),
    ({"agents.csv": "id,ability,x\na,1,0\n"}, "agents.csv line 2, column y", "a position needs x and y"),
    ({"agents.csv": "id,ability,x,y\na,1,,0\n"}, "agents.csv line 2, column x", "a position needs x and y"),
    ({"tasks.csv": "id,workload,z\nt,1,0\n"}, "tasks.csv line 2, column x", "a position needs x and y"),
    ({"agents.csv": "id,ability,start_task\na,1,t2\n"}, "agents.csv line 2, column start_task", "no task 't2'"),
    (
        {"agents.csv": "id,ability,tasks\na,1,t1; t1\n"},
        "agents.csv line 2, column tasks",
        "no task ' t1' (did you mean",
    ),
    ({"tasks.csv": "id,workload,priority\nt1,1,-3\n"}, "tasks.csv line 2, column priority", "must be a finite number"),
    ({"instance.json": ""}, "instance.json", "is empty"),
    ({"instance.json": "{"}, "instance.json line 1 column 2", "is not JSON"),
    ({"instance.json": b"\xff\xfe{\0}\0"}, "instance.json line 1", "is not UTF-8"),
    ({"instance.json": "[1]"}, "instance.json", "must be a JSON object"),
    ({"instance.json": "{}"}, "instance.json, format", "is missing"),
    ({"instance.json": '{"format": "alloc-instance/1", "tau": 2}'}, "instance.json, tau", "between 0 and 1"),
    ({"instance.json": '{"format": "alloc-instance/1", "tau": "2"}'}, "instance.json, tau", "must be a number"),
    ({"instance.json": '{"format": "alloc-instance/1", "agents": []}'}, "instance.json", "unknown field 'agents'"),
    ({"instance.json": header(metric="geo")}, "instance.json, metric", "must be one of euclidean"),
    ({"instance.json": header(units={"speed": "m/s"})}, "instance.json, units.distance", "is missing"),
    ({"instance.json": header(distances={})}, "distances.csv", "is missing, but instance.json has the field"),
    ({"instance.json": header(distances={"rows": []})}, "instance.json, distances.rows", "must be in distances.csv"),
    ({"instance.json": header(distances={"mising": ""})}, "instance.json, distances", "did you mean 'missing'?"),
    (
        {"instance.json": header(distances={"missing": "x"}), "distances.csv": "from,to,distance\n"},
        "instance.json, distances.missing",
        "must be 'metric' or 'unreachable'",
    ),
    (
        {"agents.csv": "id,ability,lon,lat\na,1,8,50\n"},
        "agents.csv",
        """the column 'lon' needs "metric": "geographic" in""",
    ),
    ({"tasks.csv": "id,workload,lon\na,1,8\n"}, "tasks.csv", "the column 'lon' needs"),
    (
        {"agents.csv": "id,ability,x,y\na,1,8,50\n", "instance.json": header(metric="geographic")},
        "agents.csv",
        "the column 'x' is not geographic; call it 'lon'",
    ),
    (
        {"agents.csv": "id,ability,lon\na,1,8\n", "instance.json": header(metric="geographic")},
        "agents.csv line 2, column lat",
        "a position needs lon and lat",
    ),
    (
        {"agents.csv": "id,ability,lon,lat\na,1,50,98\n", "instance.json": header(metric="geographic")},
        "agents.csv line 2, column lon and lat",
        "must be longitude (-180 to 360) and latitude",
    ),
    ({"agents.csv": "id,ability,returns\na,1,yes\n"}, "agents.csv line 2, column returns", "no base 'yes'; say true"),
    (
        {"agents.csv": "id,ability,energy_per_distance\na,1,-2\n"},
        "agents.csv line 2, column energy_per_distance",
        "must be a finite number >= 0",
    ),
    ({"agents.csv": "id,ability,skills\na,1,a\0b\n"}, "agents.csv line 2, column skills", "without NUL"),
    ({"distances.csv": "from,to\na1,t1\n"}, "distances.csv line 1", "the column 'distance' is missing"),
    ({"distances.csv": "from,to,distance\na1,t1,\n"}, "distances.csv line 2, column distance", "must have a distance"),
    ({"distances.csv": "from,to,distance\na1,t1,x\n"}, "distances.csv line 2, column distance", "must be a number"),
    ({"distances.csv": "from,to,distance\n\na1,t9,1\n"}, "distances.csv line 3, column to", "no agent or task 't9'"),
    (
        {"distances.csv": "from,to,distance\na1,t1,1\na1,t1,2\n"},
        "distances.csv line 3, column distance",
        "gives a pair that an earlier row gives",
    ),
]


def table_folder(folder: Path, files: dict[str, str | bytes]) -> Path:
    """Write a valid folder in which `files` take the place of others."""
    folder.mkdir()
    valid: dict[str, str | bytes] = {"agents.csv": "id,ability\na1,4\n", "tasks.csv": "id,workload\nt1,20\n"}
    for name, text in {**valid, **files}.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


@pytest.mark.parametrize(("files", "place", "words"), TABLES)
def test_invalid_tables_are_located(tmp_path: Path, files: dict[str, str | bytes], place: str, words: str) -> None:
    """Errors in a folder of tables name the file, the line as an editor counts it, and the column."""
    error = the_error(table_folder(tmp_path / "fleet", files))
    assert error.place == place, str(error)
    assert words in error.message, str(error)


@pytest.mark.parametrize("name", ["agents.csv", "tasks.csv", "distances.csv", "instance.json"])
def test_tables_that_are_no_files_are_named(tmp_path: Path, name: str) -> None:
    """The error names a table that is a folder, a pipe or a dangling link."""
    path = table_folder(tmp_path / "fleet", {name: ""}) / name
    path.unlink()
    if name in ("agents.csv", "tasks.csv"):
        assert the_error(tmp_path / "fleet").place == name
    path.mkdir()
    assert "is a folder where a file is expected" in the_error(tmp_path / "fleet").message
    path.rmdir()
    os.mkfifo(path)
    assert "is a pipe or device" in the_error(tmp_path / "fleet").message
    path.unlink()
    path.symlink_to("nowhere")
    error = the_error(tmp_path / "fleet")
    assert (error.place, error.message) == (name, "there is no such file; check the path")
