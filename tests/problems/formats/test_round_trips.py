"""Instances and allocations come back from files exactly as they were."""

import json
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


@settings(max_examples=150, deadline=None)
@given(instances(), st.permutations(FORMATS))
def test_any_instance_passes_through_all_formats(instance: Instance, order: list[str]) -> None:
    """Written and read in all three formats, one after the other in any order, nothing of an instance changes."""
    with tempfile.TemporaryDirectory() as folder:
        current = instance
        for file in order:
            write_instance(current, Path(folder) / file)
            current = read_instance(Path(folder) / file)
            assert_same(instance, current)


@settings(max_examples=100, deadline=None)
@given(instances())
def test_documents_are_plain_json(instance: Instance) -> None:
    """A document goes through the json module, and back to the same instance, without files."""
    assert_same(instance, from_document(json.loads(json.dumps(to_document(instance), allow_nan=False))))


@pytest.mark.parametrize("file", FORMATS)
def test_the_same_instance_gives_the_same_bytes(tmp_path: Path, file: str) -> None:
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
