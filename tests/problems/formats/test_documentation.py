"""The examples and tables of docs/data/formats.md agree with the readers."""

import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

from alloc.problems import Allocation, read_allocation, read_instance
from alloc.problems.formats.columns import AGENT_FIELDS, DISTANCE_FIELDS, TASK_FIELDS
from alloc.problems.formats.csv_folder import (
    AGENT_COLUMNS,
    DISTANCE_COLUMNS,
    MORE_AGENT_COLUMNS,
    MORE_TASK_COLUMNS,
    TASK_COLUMNS,
)
from alloc.problems.formats.document import INSTANCE_FIELDS
from alloc.problems.formats.npz_archive import FIELDS

TEXT = (Path(__file__).parents[3] / "docs" / "data" / "formats.md").read_text("utf-8")


def section(title: str) -> str:
    return TEXT.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


BASES = '{"format": "alloc-instance/1",\n "agents": [{"id": "a1", "ability": 4, "position": [3, 0], "battery"'


def example(title: str, first: str) -> str:
    """The indented block of a section that begins with `first`."""
    blocks = re.findall(r"(?:^    .*\n)+", section(title) + "\n", re.MULTILINE)
    return next(text for text in map(textwrap.dedent, blocks) if text.startswith(first))


def test_examples_are_read(tmp_path: Path) -> None:
    """The JSON, CSV, npz and allocation examples can be read as they stand."""
    (tmp_path / "x.json").write_text(example("Instance: JSON", "{"))
    instance = read_instance(tmp_path / "x.json")
    assert (instance.name, instance.n, instance.m) == ("demo", 2, 1)

    write_tables(tmp_path, example("Instance: CSV folder", "agents.csv"))
    folder = read_instance(tmp_path)
    assert folder.allowed_tasks is not None
    assert (folder.n, folder.m, folder.start_task.tolist()) == (2, 2, [0, -1])

    call = example("Instance: npz", "numpy.savez").replace('"fleet.npz"', "path")
    exec(call, {"numpy": np, "path": tmp_path / "fleet.npz"})
    assert read_instance(tmp_path / "fleet.npz").battery.tolist() == [20, np.inf]

    (tmp_path / "plan.json").write_text(example("Allocation", "{"))
    assert read_allocation(tmp_path / "plan.json", instance) == (Allocation([0, -1]), None)


def write_tables(folder: Path, text: str) -> None:
    """Write the tables that an example shows one below the other, each with its name before its first line."""
    parts = re.split(r"^(\w+\.csv)", text, flags=re.MULTILINE)[1:]
    for name, rows in zip(parts[::2], parts[1::2], strict=True):
        (folder / name).write_text(rows.replace(" ", ""))


def test_examples_of_distances_are_read(tmp_path: Path) -> None:
    """The table of distances and the tables by longitude and latitude can be read as they stand."""
    (tmp_path / "x.json").write_text(example("Instance: JSON", '{"format": "alloc-instance/1",\n "agents"'))
    reach = read_instance(tmp_path / "x.json").reach
    assert reach.density == 0.75
    assert reach.distance[reach.origin][[0, 1, 1], [0, 0, 1]].tolist() == [3.5, 0, 1.25]

    (tmp_path / "instance.json").write_text('{"format": "alloc-instance/1", "metric": "geographic"}')
    write_tables(tmp_path, example("Instance: CSV folder", "agents.csv     id,ability,lon"))
    folder = read_instance(tmp_path)
    assert (folder.skills, folder.needs) == ((("camera", "lidar"), ()), (("camera", "lidar"), ()))
    assert folder.returns.tolist() == [True, False]
    assert folder.bases.ids == ("harbour",)
    assert folder.agent_energy_per_distance.tolist() == [1.5, 1]
    assert folder.distances is not None
    assert folder.distances.distance.tolist() == [7.9, 20.5]


def test_example_of_bases_is_read(tmp_path: Path) -> None:
    """The flights of the example have the lengths given in the text."""
    (tmp_path / "x.json").write_text(example("Instance: JSON", BASES))
    reach = read_instance(tmp_path / "x.json").reach
    assert reach.cost[reach.origin].ravel().tolist() == [4 + 5, 3 + 3]


@pytest.mark.parametrize(
    ("title", "names"),
    [
        ("Instance: JSON", {*INSTANCE_FIELDS, *AGENT_FIELDS, *TASK_FIELDS, *DISTANCE_FIELDS}),
        ("Instance: npz", set(FIELDS)),
    ],
)
def test_every_field_is_documented(title: str, names: set[str]) -> None:
    """The tables of the documentation name exactly the fields that the readers know."""
    cells = re.findall(r"^\| (`.*?) \|", section(title), re.MULTILINE)
    assert {name for cell in cells for name in re.findall(r"`(\w+)`", cell)} == names


def test_every_column_is_documented() -> None:
    """The tables of the documentation have every column, in the order in which they are written."""
    text = section("Instance: CSV folder")
    assert ",".join(AGENT_COLUMNS) in text
    assert ",".join(TASK_COLUMNS) in text
    assert ",".join(MORE_AGENT_COLUMNS) in text
    assert ",".join(MORE_TASK_COLUMNS) in text
    assert ",".join(DISTANCE_COLUMNS) in text
    assert "id,lon,lat,alt" in text
