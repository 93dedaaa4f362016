"""Extreme numbers through all commands: a one-line error, or a finite result."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from hypothesis import strategies as st

from alloc.problems import fields

SIZES = st.one_of(
    st.sampled_from([5e-324, 1e-310, 1e-150, fields.LEAST, 1e-9, 1.0, 3.0, 1e9, fields.MOST, 1e150, 1e300, 1.7e308]),
    st.floats(5e-324, 1.7e308),
)
VALID = st.one_of(st.sampled_from([fields.LEAST, 1e-30, 1e-9, 1.0, 3.0, 1e9, 1e30, fields.MOST]), st.floats(0.1, 10))


@st.composite
def documents(draw: st.DrawFn, size: st.SearchStrategy[float], limit: st.SearchStrategy[float]) -> dict[str, Any]:
    """Draw an instance file with two or three agents and tasks, and extreme sizes and limits."""
    place = st.one_of(
        st.none(), st.lists(st.one_of(st.just(0.0), size, size.map(lambda x: -x)), min_size=2, max_size=2)
    )
    maybe = st.one_of(st.none(), st.just(0.0), limit)

    def agent(number: int) -> dict[str, Any]:
        return {
            "id": f"a{number}",
            "ability": draw(size),
            "position": draw(place),
            "battery": draw(maybe),
            "range": draw(maybe),
            "speed": draw(st.one_of(st.none(), size)),
        }

    def task(number: int) -> dict[str, Any]:
        return {
            "id": f"t{number}",
            "workload": draw(st.one_of(st.just(0.0), size)),
            "position": draw(place),
            "priority": draw(maybe.filter(lambda x: x is not None)),
        }

    count = st.integers(2, 3)
    return {
        "format": "alloc-instance/1",
        "energy_per_distance": draw(st.one_of(st.just(0.0), st.just(1.0), size)),
        "agents": [agent(i) for i in range(draw(count))],
        "tasks": [task(j) for j in range(draw(count))],
    }


def finite(value: Any) -> bool:
    """Return whether all numbers in a JSON value are finite."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, list):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def check(alloc, document: dict[str, Any], *, valid: bool) -> None:
    """Run the commands on a file; the first one determines whether the file is valid."""
    Path("x.json").write_text(json.dumps(document))
    ran = alloc("validate", "x.json")
    if ran.code == 2:
        assert not valid, ran.err
        assert ran.out == ""
        assert len(ran.err.splitlines()) == 1, ran.err
        return
    assert ran.code in (0, 1), ran.err
    short = ["--iterations", "2", "--threads", "1"]
    files = ["--output", "r.json"]
    for objective in ("makespan", "makespan-energy"):
        for method in ("greedy", "local-search", "auto"):
            drawn = ["--plot", "r.svg"] if method == "greedy" else []
            ran = alloc("solve", "x.json", "--method", method, "--objective", objective, *short, *files, *drawn)
            assert ran.code in (0, 1), (method, objective, ran.err)
            assert finite(json.loads(Path("r.json").read_text()))
    ran = alloc("evaluate", "x.json", "r.json", "--json")
    assert ran.code in (0, 1), ran.err
    assert finite(ran.json)
    ran = alloc("pareto", "x.json", "--method", "local-search", "--points", "2", *short, "--json")
    assert ran.code in (0, 1), ran.err
    assert finite(ran.json)


SLOW = settings(
    max_examples=4,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],  # to shrink would take minutes
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.mark.slow
@SLOW
@given(documents(VALID, SIZES))
def test_magnitudes_within_the_limits(alloc, document: dict[str, Any]) -> None:
    """Any combination of valid values gives finite results in all commands, without warnings."""
    check(alloc, document, valid=True)


MIXED: dict[str, Any] = {
    "format": "alloc-instance/1",
    "agents": [{"id": "a", "ability": 1}, {"id": "b", "ability": 2}],
    "tasks": [{"id": "t0", "workload": 5e-324}, {"id": "t1", "workload": 3}],
}


@SLOW
@given(documents(SIZES, SIZES))
@example(MIXED)
def test_magnitudes_beyond_the_limits(alloc, document: dict[str, Any]) -> None:
    """A file with any floats is refused in one line, or handled by all commands."""
    check(alloc, document, valid=False)
