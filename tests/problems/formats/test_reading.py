"""Input accepted by readers: defaults, short forms, equivalent encodings."""

import io
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from alloc.problems import Allocation, Instance, read_allocation, read_instance, write_allocation, write_instance

Same = Callable[[Instance, Instance], None]

DESIGN = """{"format": "alloc-instance/1", "name": "demo", "tau": 0.5, "energy_per_distance": 6.0,
 "agents": [{"id": "a1", "ability": 4, "position": [0.1, 0.2, 0.3], "start_task": "t2",
             "battery": 20, "range": null, "speed": null, "tasks": null},
            {"id": "a2", "ability": 1.5}],
 "tasks": [{"id": "t1", "workload": 20, "position": [0, 0, 0], "priority": 1},
           {"id": "t2", "workload": 3, "position": [1, 2]}]}"""


def test_documented_example_is_read(tmp_path: Path) -> None:
    """Each field of the documented example is read correctly, and 2-D positions get z = 0."""
    (tmp_path / "x.json").write_text(DESIGN)
    instance = read_instance(tmp_path / "x.json")
    assert (instance.name, instance.tau, instance.energy_per_distance) == ("demo", 0.5, 6.0)
    assert instance.ability.tolist() == [4, 1.5]
    assert instance.start_task.tolist() == [1, -1]
    assert instance.battery.tolist() == [20, np.inf]
    assert np.isinf(instance.communication_range).all()
    assert np.isinf(instance.speed).all()
    assert instance.task_position.tolist() == [[0, 0, 0], [1, 2, 0]]
    assert np.isnan(instance.agent_position[1]).all()
    assert instance.allowed_tasks is None


@pytest.mark.parametrize("file", ["small.json", "small", "small.npz"])
def test_defaults_of_optional_fields(tmp_path: Path, file: str) -> None:
    """With only the required fields, the name is the file's stem and the rest is as documented, in every format."""
    path = tmp_path / file
    if path.suffix == ".json":
        agents, tasks = [{"id": "a", "ability": 1}], [{"id": "t", "workload": 2}]
        path.write_text(json.dumps({"format": "alloc-instance/1", "agents": agents, "tasks": tasks}))
    elif path.suffix == ".npz":
        np.savez(path, format="alloc-instance/1", agent_id=["a"], agent_ability=[1], task_id=["t"], task_workload=[2])
    else:
        path.mkdir()
        (path / "agents.csv").write_text("id,ability\na,1\n")
        (path / "tasks.csv").write_text("id,workload\nt,2\n")
    instance = read_instance(path)
    assert (instance.name, instance.tau, instance.energy_per_distance) == ("small", 0.5, 1.0)
    assert instance.priority.tolist() == [1]
    assert instance.start_task.tolist() == [-1]
    assert np.isnan(instance.start_position).all()


def test_null_means_the_default(tmp_path: Path) -> None:
    """Null is equivalent to leaving an optional field out."""
    document = json.loads(DESIGN)
    document |= {"name": None, "tau": None, "energy_per_distance": None}
    document["agents"] = [{"id": "a", "ability": 1, "position": None, "start_task": None, "tasks": None}]
    document["tasks"][0] |= {"position": None, "priority": None}
    (tmp_path / "x.json").write_text(json.dumps(document))
    instance = read_instance(tmp_path / "x.json")
    assert (instance.name, instance.tau, instance.energy_per_distance) == ("x", 0.5, 1.0)
    assert instance.priority.tolist() == [1, 1]


def test_csv_of_spreadsheets_is_read(tmp_path: Path) -> None:
    """Windows line ends, a byte order mark, spaces in the header, blank lines, no z, lists of tasks."""
    text = "\ufeffid, ability ,x,y,tasks\r\na1,1,0.5,2,t1;t2\r\n\r\na2, 3 ,,,\r\na3,1e2,1,1,;\r\n"
    (tmp_path / "agents.csv").write_bytes(text.encode())
    (tmp_path / "tasks.csv").write_text("workload,id\n5,t1\n6,t2")
    (tmp_path / "instance.json").write_text('{"format": "alloc-instance/1", "tau": 0.25}')
    instance = read_instance(tmp_path)
    assert instance.name == tmp_path.name
    assert instance.tau == 0.25
    assert instance.ability.tolist() == [1, 3, 100]
    assert instance.agent_position[0].tolist() == [0.5, 2, 0]
    assert np.isnan(instance.agent_position[1]).all()
    assert instance.allowed_tasks is not None
    assert [None if tasks is None else tasks.tolist() for tasks in instance.allowed_tasks] == [[0, 1], None, []]


def test_byte_order_mark_is_ignored_in_json(tmp_path: Path) -> None:
    """JSON with a leading byte order mark is read."""
    (tmp_path / "x.json").write_bytes(b"\xef\xbb\xbf" + DESIGN.encode())
    assert read_instance(tmp_path / "x.json").name == "demo"


def test_npz_of_other_number_types_is_read(tmp_path: Path) -> None:
    """Integers, single precision, other byte orders and 2-D positions are accepted in .npz."""
    np.savez_compressed(
        tmp_path / "x.npz",
        format="alloc-instance/1",
        agent_id=np.array(["a", "b"], dtype=">U3"),
        agent_ability=np.array([1, 2], dtype=">i2"),
        agent_position=np.array([[1, 2], [np.nan, np.nan]], dtype=np.float32),
        task_id=["t"],
        task_workload=np.array([2.5], dtype=np.float16),
    )
    instance = read_instance(tmp_path / "x.npz")
    assert instance.ability.tolist() == [1, 2]
    assert instance.workload.tolist() == [2.5]
    assert instance.agent_position[0].tolist() == [1, 2, 0]
    assert np.isnan(instance.agent_position[1]).all()


def test_standard_input_and_output(monkeypatch: pytest.MonkeyPatch, capsysbinary: Any, full: Instance) -> None:
    """The path - writes UTF-8 JSON to standard output and reads it from standard input."""
    write_instance(full, "-")
    text = capsysbinary.readouterr().out
    assert "Zoë" in text.decode("utf-8")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text), encoding="ascii"))
    assert read_instance("-").agent_ids == full.agent_ids
    unnamed = json.loads(text)
    del unnamed["name"]
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(unnamed)))
    assert read_instance("-").name == "instance"


def test_result_is_read_as_an_allocation(tmp_path: Path) -> None:
    """The assignment of a result file is read, its other fields are ignored, and missing agents are idle."""
    instance = Instance(ability=[1, 2, 3], workload=[4, 5])
    result = {"format": "alloc-result/1", "status": "feasible", "assignment": {"a1": "t2", "a2": None}, "new": 1}
    (tmp_path / "r.json").write_text(json.dumps(result))
    assert read_allocation(tmp_path / "r.json", instance) == (Allocation([1, -1, -1]), None)


def test_allocation_for_another_instance_is_a_warning(tmp_path: Path) -> None:
    """An allocation made for an instance of another name is used, and the warning names both on one line."""
    instance = Instance(name="one\nline", ability=[1], workload=[4])
    write_allocation(Allocation([0]), instance, tmp_path / "plan.json")
    other = Instance(name="other", ability=[1], workload=[4])
    allocation, warning = read_allocation(tmp_path / "plan.json", other)
    assert allocation == Allocation([0])
    assert warning is not None
    assert "plan.json" in warning
    assert r"'one\nline'" in warning
    assert "'other'" in warning


@pytest.mark.parametrize("empty", [",", ",,,,,", " , ", '"",""', "\t,\t"])
def test_empty_rows_of_spreadsheets_are_skipped(tmp_path: Path, empty: str) -> None:
    """Empty rows, which spreadsheets write as commas, are skipped anywhere in the table."""
    (tmp_path / "agents.csv").write_text(f"{empty}\nid,ability\na,1\n{empty}\n{empty}\nb,2\n{empty}\n")
    (tmp_path / "tasks.csv").write_text(f"id,workload\n{empty}\nt,3\n{empty}")
    instance = read_instance(tmp_path)
    assert (instance.agent_ids, instance.ability.tolist(), instance.task_ids) == (("a", "b"), [1, 2], ("t",))
