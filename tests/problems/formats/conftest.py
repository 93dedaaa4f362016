"""Instances of every kind, and exact comparisons of instances."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

from alloc.problems import DistanceTable, InputError, Instance, Units, read_instance
from alloc.problems.fields import LEAST, MOST

ARRAYS = (
    "ability",
    "workload",
    "agent_position",
    "task_position",
    "start_task",
    "return_base",
    "battery",
    "communication_range",
    "speed",
    "priority",
    "agent_energy_per_distance",
)


def assert_same(left: Instance, right: Instance) -> None:
    """Compare every field exactly, the sign of zero included."""
    for field in ARRAYS:
        a, b = getattr(left, field), getattr(right, field)
        np.testing.assert_array_equal(a, b, err_msg=field)
        assert (np.signbit(a) == np.signbit(b))[~np.isnan(a)].all(), field
    assert (left.name, left.agent_ids, left.task_ids) == (right.name, right.agent_ids, right.task_ids)
    assert (left.tau, left.energy_per_distance) == (right.tau, right.energy_per_distance)
    assert (left.metric, left.units) == (right.metric, right.units)
    assert (left.skills, left.needs, left.returns.tolist()) == (right.skills, right.needs, right.returns.tolist())
    assert left.bases.ids == right.bases.ids
    np.testing.assert_array_equal(left.bases.position, right.bases.position)
    assert_same_distances(left.distances, right.distances)
    assert (left.allowed_tasks is None) == (right.allowed_tasks is None)
    for one, other in zip(left.allowed_tasks or (), right.allowed_tasks or (), strict=True):
        assert (one is None) == (other is None)
        assert one is None or np.array_equal(one, other)


def assert_same_distances(left: DistanceTable | None, right: DistanceTable | None) -> None:
    """Compare two tables of distances exactly, row by row."""
    assert (left is None) == (right is None)
    if left is None or right is None:
        return
    assert (left.n, left.m, left.bases, left.missing) == (right.n, right.m, right.bases, right.missing)
    for field in ("source", "target", "distance"):
        np.testing.assert_array_equal(getattr(left, field), getattr(right, field), err_msg=field)


def the_error(path: Any, read: Callable[[Any], object] = read_instance) -> InputError:
    """Return the error of reading `path`, after checking that it fits on one readable line."""
    with pytest.raises(InputError) as caught:
        read(path)
    error, text = caught.value, str(caught.value)
    assert text == ": ".join(part for part in (error.source, error.place, error.message) if part)
    assert text.isprintable(), text
    assert len(text) < 600, text
    assert error.source == ("standard input" if path == "-" else str(path))
    assert error.message
    return error


@pytest.fixture
def bound(tmp_path: Path) -> Iterator[Path]:
    """A folder in which permissions apply: root acts as an unprivileged user during the test."""
    if os.geteuid() != 0:
        yield tmp_path
        return
    nobody = 65534
    with tempfile.TemporaryDirectory() as folder:
        os.chown(folder, nobody, nobody)
        try:
            os.setresuid(nobody, nobody, 0)
        except (AttributeError, PermissionError):
            pytest.skip("nothing is protected from root, who cannot be another here")
        try:
            yield Path(folder)
        finally:
            os.setresuid(0, 0, 0)


@pytest.fixture
def same() -> Callable[[Instance, Instance], None]:
    return assert_same


@pytest.fixture
def full() -> Instance:
    """Two tasks and three agents that use every field, with names that need care."""
    return Instance(
        name="demo",
        ability=[4, 2.5, 0.1],
        workload=[20, 0],
        agent_ids=["a1", 'Zoë; \\ or "so"', "line\r\nbreak,"],
        task_ids=["t;1", "t2\\"],
        agent_position=[[0.1, 0.2, 0.3], [np.nan] * 3, [-0.0, 1e-300, 1e60]],
        task_position=[[0, 0, 0], [np.nan] * 3],
        start_task=[1, -1, 0],
        battery=[20, np.inf, 0],
        communication_range=[np.inf, 0.5, 1],
        speed=[np.inf, 2, 1 / 3],
        allowed_tasks=[None, [], [0, 1]],
        priority=[1, 2.5],
        tau=0.25,
        energy_per_distance=6,
    )


@pytest.fixture
def varied() -> Instance:
    """Three tasks and three agents on the earth that use every field which files may leave out throughout."""
    return Instance(
        name="varied",
        ability=[4, 2.5, 1],
        workload=[20, 5, 1],
        agent_ids=["d1", 'the "big", one', "d;3"],
        agent_position=[
            [14.1, 67.3],
            [np.nan] * 2,
            [
                -179.5,
                -89,
            ],
        ],
        task_position=[[14.2, 67.25, 100.5], [13.9, 67.4, 0], [np.nan] * 3],
        start_task=[-1, 1, -1],
        battery=[20, 30, np.inf],
        speed=[60, 30, np.inf],
        energy_per_distance=2,
        agent_energy_per_distance=[None, 0.125, 2],
        returns=[True, False, True],
        return_base=[-1, -1, 1],
        skills=[["lidar", "camera"], [], ["back\\slash", "semi;colon", 'com,ma "q"']],
        needs=[["camera"], None, ["semi;colon"]],
        metric="geographic",
        distances=DistanceTable.of(
            [
                ("d1", "t1", 7.25),
                ("t1", "d1", 9),
                ("t1", "t2", 0),
                ('the "big", one', "t3", 1 / 3),
                ("t3", 'south, "old"', 2.5),
            ],
            ["d1", 'the "big", one', "d;3"],
            ["t1", "t2", "t3"],
            missing="unreachable",
            base_ids=["north", 'south, "old"'],
        ),
        bases={"north": (14, 67.2, 12), 'south, "old"': None},
        units=Units(time="h", distance="nmi", energy="kWh", work="m²"),
    )


TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), min_size=1, max_size=8)
TRICKY = st.text(st.sampled_from(list(';\\",\r\n \ta1')), min_size=1, max_size=5)
IDS = st.one_of(TEXT, TRICKY)
COORDINATES = st.floats(-MOST, MOST)
MAGNITUDES = st.floats(LEAST, MOST)


def _row(free: bool) -> st.SearchStrategy[list[float]]:
    position = st.lists(COORDINATES, min_size=3, max_size=3)
    return st.one_of(st.just([np.nan] * 3), position) if free else position


LABELS = st.text(st.characters(exclude_categories=["C", "Z"]), max_size=20)


@st.composite
def optional_fields(draw: st.DrawFn, agents: list[str], tasks: list[str]) -> dict[str, Any]:
    """Draw what files may leave out throughout, but for geographic positions."""
    n, m = len(agents), len(tasks)
    names = st.one_of(st.none(), st.lists(IDS, max_size=3))
    rate = st.one_of(st.none(), st.just(0.0), MAGNITUDES)
    names_of_bases = IDS.filter(lambda name: name.strip().lower() not in ("", "true", "false"))
    bases = draw(st.lists(names_of_bases, max_size=2, unique=True))
    known = agents + tasks + bases
    shared = {name for name in known if known.count(name) > 1}
    pairs = [(one, other) for one in known for other in tasks if not shared & {one, other}]
    pairs += [(other, one) for one, other in pairs if (other, one) not in pairs]
    chosen = draw(st.lists(st.sampled_from(pairs), max_size=4, unique=True)) if pairs else []
    rows = [(*pair, draw(st.floats(0, 1e100))) for pair in chosen]
    table = DistanceTable.of(
        rows, agents, tasks, missing=draw(st.sampled_from(["metric", "unreachable"])), base_ids=bases
    )
    fields = {
        "agent_energy_per_distance": draw(st.lists(rate, min_size=n, max_size=n)),
        "returns": draw(st.lists(st.booleans(), min_size=n, max_size=n)),
        "skills": draw(st.lists(names, min_size=n, max_size=n)),
        "needs": draw(st.lists(names, min_size=m, max_size=m)),
        "metric": draw(st.sampled_from(["euclidean", "manhattan"])),
        "distances": table,
        "units": Units(*draw(st.lists(LABELS, min_size=4, max_size=4))),
    }
    chosen_fields = {name: value for name, value in fields.items() if draw(st.booleans())}
    if not bases:
        return chosen_fields
    home = draw(st.lists(st.integers(-1, len(bases) - 1), min_size=n, max_size=n))
    flags = [flag or base >= 0 for flag, base in zip(fields["returns"], home, strict=True)]
    places = {name: draw(st.one_of(st.none(), _row(free=False))) for name in bases}
    return chosen_fields | {"returns": flags, "return_base": home, "bases": places}


@st.composite
def instances(draw: st.DrawFn) -> Instance:
    """Draw any small instance."""
    n, m = draw(st.integers(1, 4)), draw(st.integers(1, 4))
    limit = st.one_of(st.just(np.inf), st.floats(0, 1e100))

    def column(values: st.SearchStrategy[float], count: int) -> list[float]:
        return draw(st.lists(values, min_size=count, max_size=count))

    subset = st.one_of(st.none(), st.lists(st.integers(0, m - 1), max_size=4, unique=True))
    ids = [draw(st.lists(IDS, min_size=count, max_size=count, unique=True)) for count in (n, m)]
    return Instance(
        name=draw(st.one_of(st.just(""), IDS)),
        agent_ids=ids[0],
        task_ids=ids[1],
        **draw(st.one_of(st.just({}), optional_fields(*ids))),
        ability=column(MAGNITUDES, n),
        workload=column(st.one_of(st.just(0.0), st.integers(0, 2**60), MAGNITUDES), m),
        agent_position=column(_row(free=True), n),
        task_position=column(_row(free=draw(st.booleans())), m),
        start_task=column(st.integers(-1, m - 1), n),
        battery=column(limit, n),
        communication_range=column(limit, n),
        speed=column(st.one_of(st.just(np.inf), MAGNITUDES), n),
        allowed_tasks=column(subset, n),
        priority=column(st.floats(0, 1e100), m),
        tau=draw(st.floats(0, 1, exclude_min=True, exclude_max=True)),
        energy_per_distance=draw(st.one_of(st.just(0.0), MAGNITUDES)),
    )
