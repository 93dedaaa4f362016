"""Each fault in a folder of tables is one line with folder, file, line and column, and mend."""

import os
from pathlib import Path

import pytest

from .conftest import the_error

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
    ({"agents.csv": "id,ability\na,1\nb\n"}, "agents.csv line 3", "has 1 cells, but there are 2 columns"),
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
]


def table_folder(folder: Path, files: dict[str, str | bytes]) -> Path:
    """Write a valid folder in which `files` take the place of others."""
    folder.mkdir()
    valid: dict[str, str | bytes] = {"agents.csv": "id,ability\na1,4\n", "tasks.csv": "id,workload\nt1,20\n"}
    for name, text in {**valid, **files}.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder


@pytest.mark.parametrize(("files", "place", "words"), TABLES)
def test_tables_that_break_a_rule(tmp_path: Path, files: dict[str, str | bytes], place: str, words: str) -> None:
    """Each fault in a folder of tables is told with the file, the line as an editor counts it, and the column."""
    error = the_error(table_folder(tmp_path / "fleet", files))
    assert error.place == place, str(error)
    assert words in error.message, str(error)


@pytest.mark.parametrize("name", ["agents.csv", "tasks.csv", "instance.json"])
def test_folders_with_odd_entries(tmp_path: Path, name: str) -> None:
    """A table that is a folder, a pipe or a dangling link is told by name."""
    path = table_folder(tmp_path / "fleet", {name: ""}) / name
    path.unlink()
    if name != "instance.json":
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
