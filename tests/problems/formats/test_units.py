"""Units are labels; speeds in another unit are converted once, on reading."""

import json
from pathlib import Path

import numpy as np
import pytest

from alloc.problems import InputError, Instance, Units, read_instance, write_instance
from alloc.problems.formats import from_document, to_document
from alloc.problems.units import speed_factor


@pytest.mark.parametrize(
    ("speed", "distance", "time", "factor"),
    [
        ("m/s", "km", "h", 3.6),
        ("m/s", "m", "min", 60),
        ("km/h", "km", "h", 1),
        ("km/h", "m", "s", 1 / 3.6),
        ("kn", "nmi", "h", 1),
        ("kn", "km", "h", 1.852),
        ("mph", "km", "h", 1.609344),
        ("mph", "mi", "d", 24),
        ("ft/min", "m", "s", 0.00508),
        ("nmi/d", "mi", "min", 1852 / 1609.344 / 1440),
    ],
)
def test_factors_are_exact(speed: str, distance: str, time: str, factor: float) -> None:
    """The factor of a speed is the float nearest to the ratio of the units."""
    assert speed_factor(speed, Units(time=time, distance=distance)) == pytest.approx(factor, rel=1e-15)


def given(file: Path, **units: str) -> Path:
    """Write an instance with speeds 10 and null in these units, in the format of the suffix."""
    if file.suffix == ".npz":
        arrays = {"agent_id": ["a", "b"], "agent_ability": [1, 1], "task_id": ["t"], "task_workload": [1]}
        labels = {f"units_{name}": label for name, label in units.items()}
        np.savez(file, format="alloc-instance/1", agent_speed=[10, np.nan], **arrays, **labels)
        return file
    header = {"format": "alloc-instance/1", "units": units}
    if file.suffix == ".json":
        agents = [{"id": "a", "ability": 1, "speed": 10}, {"id": "b", "ability": 1}]
        file.write_text(json.dumps({**header, "agents": agents, "tasks": [{"id": "t", "workload": 1}]}))
        return file
    file.mkdir()
    (file / "instance.json").write_text(json.dumps(header))
    (file / "agents.csv").write_text("id,ability,speed\na,1,10\nb,1,\n")
    (file / "tasks.csv").write_text("id,workload\nt,1\n")
    return file


@pytest.mark.parametrize("name", ["x.json", "x", "x.npz"])
def test_speeds_are_converted_once(tmp_path: Path, name: str) -> None:
    """Speeds in m/s are converted to km/h on reading, and written without their original unit."""
    instance = read_instance(given(tmp_path / name, speed="m/s", distance="km", time="h"))
    assert instance.speed.tolist() == [36, np.inf]
    assert instance.units == Units(distance="km", time="h")
    for target in ("copy.json", "copy", "copy.npz"):
        write_instance(instance, tmp_path / target)
        instance = read_instance(tmp_path / target)
        assert instance.speed.tolist() == [36, np.inf]
        assert instance.units == Units(distance="km", time="h")
    assert "speed" not in json.loads((tmp_path / "copy.json").read_text())["units"]


@pytest.mark.parametrize("name", ["x.json", "x", "x.npz"])
def test_labels_without_a_unit_of_speed_convert_nothing(tmp_path: Path, name: str) -> None:
    """Any text is a label, and numbers stay as they are."""
    instance = read_instance(given(tmp_path / name, distance="Seemeilen", time="h", work="Stück"))
    assert instance.speed.tolist() == [10, np.inf]
    assert instance.units == Units(distance="Seemeilen", time="h", work="Stück")


def test_empty_labels_are_no_labels() -> None:
    """Null and an empty text are the same as no label, and are not written."""
    row = {"agents": [{"id": "a", "ability": 1}], "tasks": [{"id": "t", "workload": 1}]}
    document = {"format": "alloc-instance/1", "units": {"time": None, "work": "", "energy": "J"}, **row}
    instance = from_document(document)
    assert instance.units == Units(energy="J")
    assert to_document(instance)["units"] == {"energy": "J"}
    assert "units" not in to_document(Instance(ability=[1], workload=[1]))


def test_speeds_out_of_range_after_conversion_are_refused() -> None:
    """A speed that is too small in the units of the instance is an error at its place."""
    row = {"agents": [{"id": "a", "ability": 1, "speed": 1e-60}], "tasks": [{"id": "t", "workload": 1}]}
    units = {"time": "s", "distance": "km", "speed": "m/s"}
    with pytest.raises(InputError, match=r"agents\[0\]\.speed: must be >= 1e-60"):
        from_document({"format": "alloc-instance/1", "units": units, **row})
