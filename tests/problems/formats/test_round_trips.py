"""Instances and allocations come back from files exactly as they were."""

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alloc.problems import (
    Allocation,
    Family,
    Instance,
    paper,
    random_instance,
    read_allocation,
    read_instance,
    write_allocation,
    write_instance,
)
from alloc.problems.formats import from_document, to_document

from .conftest import assert_same, instances

Same = Callable[[Instance, Instance], None]
FORMATS = ("x.json", "x", "x.npz")


@pytest.mark.parametrize("file", FORMATS)
def test_every_field_survives(full: Instance, same: Same, tmp_path: Path, file: str) -> None:
    """An instance that uses every field is the same after writing and reading."""
    write_instance(full, tmp_path / file)
    same(full, read_instance(tmp_path / file))


@pytest.mark.parametrize("file", FORMATS)
def test_every_optional_field_survives(varied: Instance, same: Same, tmp_path: Path, file: str) -> None:
    """Metric, distances, units, rates, returns, skills and needs are the same after writing and reading."""
    write_instance(varied, tmp_path / file)
    same(varied, read_instance(tmp_path / file))


@pytest.mark.parametrize("file", FORMATS)
def test_fields_that_are_not_used_are_not_written(full: Instance, tmp_path: Path, file: str) -> None:
    """Files of an instance that does not use newer fields do not contain them."""
    write_instance(full, tmp_path / file)
    if file == "x.npz":
        with np.load(tmp_path / file) as arrays:
            names = set(arrays)
    elif file == "x":
        assert sorted(os.listdir(tmp_path / file)) == ["agents.csv", "instance.json", "tasks.csv"]
        heads = [(tmp_path / file / name).read_text("utf-8").partition("\n")[0] for name in ("agents.csv", "tasks.csv")]
        names = {name for head in heads for name in head.split(",")} | {
            *json.loads((tmp_path / "x/instance.json").read_text())
        }
    else:
        document = json.loads((tmp_path / file).read_text("utf-8"))
        names = {*document, *document["agents"][0], *document["tasks"][0]} - {"energy_per_distance"}
        assert "energy_per_distance" not in document["agents"][0]
    later = ("metric", "distance", "units", "returns", "skills", "needs", "agent_energy")
    assert [name for name in names if any(word in name for word in later) and name != "energy_per_distance"] == []


@settings(max_examples=150, deadline=None)
@given(instances(), st.permutations(FORMATS))
def test_instances_survive_all_formats(instance: Instance, order: list[str]) -> None:
    """An instance does not change when written and read in all three formats, in any order."""
    with tempfile.TemporaryDirectory() as folder:
        current = instance
        for file in order:
            write_instance(current, Path(folder) / file)
            current = read_instance(Path(folder) / file)
            assert_same(instance, current)


@settings(max_examples=100, deadline=None)
@given(instances())
def test_documents_survive_the_json_module(instance: Instance) -> None:
    """A document goes through the json module, and back to the same instance, without files."""
    assert_same(instance, from_document(json.loads(json.dumps(to_document(instance), allow_nan=False))))


@pytest.mark.parametrize("file", FORMATS)
def test_same_instance_gives_the_same_bytes(tmp_path: Path, file: str) -> None:
    """Writing is deterministic, so that files can be compared and cached."""
    contents = []
    for number in (1, 2):
        path = tmp_path / str(number) / file
        path.parent.mkdir()
        write_instance(paper(1, 7), path)
        files = sorted(path.iterdir()) if path.is_dir() else [path]
        contents.append([file.read_bytes() for file in files])
    assert contents[0] == contents[1]


@pytest.mark.parametrize("file", FORMATS)
def test_large_instances_survive(same: Same, tmp_path: Path, file: str) -> None:
    """Ten thousand real-valued agents with lists of tasks are the same after writing and reading."""
    instance = random_instance(Family(agents=10_000, tasks=50, integer=False, allowed_fraction=0.1, speed=(1, 2)), 3)
    write_instance(instance, tmp_path / file)
    same(instance, read_instance(tmp_path / file))


def test_whole_numbers_have_no_fraction(tmp_path: Path) -> None:
    """Text formats say 4, not 4.0, and keep the sign of zero and every digit."""
    instance = Instance(ability=[4, 0.1], workload=[2.0**60], agent_position=[[-0.0, 0, 1], [0, 0, 0]])
    document = to_document(instance)
    assert json.dumps(document["agents"][0]["ability"]) == "4"
    assert json.dumps(document["agents"][0]["position"]) == "[-0.0, 0, 1]"
    assert document["agents"][1]["ability"] == 0.1
    assert document["tasks"][0]["workload"] == 2.0**60


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_allocations_survive(data: st.DataObject) -> None:
    """An allocation is the same after writing and reading, without a warning."""
    instance = data.draw(instances())
    tasks = st.lists(st.integers(-1, instance.m - 1), min_size=instance.n, max_size=instance.n)
    allocation = Allocation(data.draw(tasks))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.json"
        write_allocation(allocation, instance, path)
        assert read_allocation(path, instance) == (allocation, None)
        assert list(json.loads(path.read_text("utf-8"))["assignment"]) == list(instance.agent_ids)


def test_distances_of_a_replaced_instance_are_removed(
    varied: Instance, full: Instance, same: Same, tmp_path: Path
) -> None:
    """In a folder of tables, an instance without distances replaces one with them, and other files are kept."""
    write_instance(varied, tmp_path / "x")
    (tmp_path / "x" / "notes.txt").write_text("mine")
    write_instance(full, tmp_path / "x")
    same(full, read_instance(tmp_path / "x"))
    assert sorted(os.listdir(tmp_path / "x")) == ["agents.csv", "instance.json", "notes.txt", "tasks.csv"]


def test_geographic_tables_name_their_coordinates(varied: Instance, tmp_path: Path) -> None:
    """Longitude, latitude and altitude have columns of these names, and lists without entries are empty cells."""
    write_instance(varied, tmp_path / "x")
    agents = (tmp_path / "x" / "agents.csv").read_text("utf-8").splitlines()
    head = "id,ability,lon,lat,alt,start_task,battery,range,speed,tasks,energy_per_distance,returns,skills"
    assert agents[:2] == [head, "d1,4,14.1,67.3,0,,20,,60,,,true,camera;lidar"]
    assert agents[2] == '"the ""big"", one",2.5,,,,t2,30,,30,,0.125,false,'
    assert (tmp_path / "x" / "distances.csv").read_text("utf-8").startswith("from,to,distance\nd1,t1,7.25\nt1,d1,9\n")
    assert json.loads((tmp_path / "x" / "instance.json").read_text("utf-8"))["distances"] == {"missing": "unreachable"}


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-180, 360), st.floats(-90, 90), st.floats(-1e60, 1e60)), min_size=1, max_size=3),
    st.permutations(FORMATS),
)
def test_geographic_positions_survive(places: list[tuple[float, float, float]], order: list[str]) -> None:
    """Longitude, latitude and altitude are exact after writing and reading in all formats."""
    instance = Instance(ability=[1] * len(places), workload=[1], agent_position=places, metric="geographic")
    with tempfile.TemporaryDirectory() as folder:
        current = instance
        for file in order:
            write_instance(current, Path(folder) / file)
            current = read_instance(Path(folder) / file)
            assert_same(instance, current)


def test_npz_arrays_are_as_documented(full: Instance, tmp_path: Path) -> None:
    """The columnar file opens with numpy alone and holds the documented types, NaN and "" for null."""
    write_instance(full, tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz", allow_pickle=False) as arrays:
        kinds = {name: array.dtype.kind for name, array in arrays.items()}
        assert {name for name, kind in kinds.items() if kind == "U"} == {
            *("format", "name", "agent_id", "agent_start_task", "agent_tasks", "task_id"),
        }
        assert {name for name, kind in kinds.items() if kind == "i"} == {"agent_tasks_count"}
        assert arrays["agent_start_task"].tolist() == ["t2\\", "", "t;1"]
        assert arrays["agent_tasks_count"].tolist() == [-1, 0, 2]
        np.testing.assert_array_equal(arrays["agent_battery"], [20, np.nan, 0])
