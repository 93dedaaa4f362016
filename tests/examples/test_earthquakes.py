"""The instance with real places agrees with its script and its README."""

import runpy

import numpy as np
import pytest

from alloc.allocators import solve
from alloc.problems import fewest_unserved, lp_makespan_lower_bound, makespan_lower_bound
from alloc.problems.formats import read_instance


@pytest.fixture(scope="module")
def folder(request):
    return request.config.rootpath / "examples" / "earthquakes"


@pytest.fixture(scope="module")
def alaska(folder):
    return read_instance(folder / "alaska.json")


def test_script_reproduces_the_committed_instance(folder, tmp_path):
    """The script reproduces the same agents and tasks; only the last digit may depend on the machine."""
    script = runpy.run_path(str(folder / "build.py"))
    script["main"].__globals__["OUTPUT"] = tmp_path / "again.json"
    script["main"]()
    old, new = read_instance(folder / "alaska.json"), read_instance(tmp_path / "again.json")
    assert (old.agent_ids, old.task_ids) == (new.agent_ids, new.task_ids)
    for field in ("ability", "battery", "communication_range", "agent_position", "workload", "task_position"):
        np.testing.assert_allclose(getattr(old, field), getattr(new, field), rtol=1e-3, atol=2e-3)


def test_distances_are_kilometres(folder, alaska):
    """Anchorage to Fairbanks is 420 km along the great circle (haversine); the projection is within 1 % of it."""
    first = {name[:4]: index for index, name in reversed(list(enumerate(alaska.agent_ids)))}
    anchorage, fairbanks = alaska.agent_position[[first["PANC"], first["PAFA"]], :2]
    latitude, longitude = np.radians([[61.1743, 64.8151], [-149.9963, -147.8561]])
    half = np.sin(np.diff(latitude) / 2) ** 2 + np.cos(latitude).prod() * np.sin(np.diff(longitude) / 2) ** 2
    along = 2 * 6371.0088 * np.arcsin(np.sqrt(half[0]))
    assert np.linalg.norm(anchorage - fairbanks) == pytest.approx(along, rel=0.01)


def test_reach_restricts(alaska):
    """Every site can be served, drones reach about half of them, and the bound by reach is above the plain one."""
    assert (alaska.n, alaska.m) == (384, 48)
    assert fewest_unserved(alaska) == 0
    assert 0.4 < alaska.reach.mask[alaska.reach.origin].mean() < 0.6
    bound = lp_makespan_lower_bound(alaska)
    assert bound is not None
    assert bound > makespan_lower_bound(alaska) * 1.001


def test_search_is_far_better_than_greedy(alaska):
    """Largest ability first is far above the bound; a short search comes close to it."""
    greedy, better = solve(alaska, "greedy"), solve(alaska, "ga", time_limit_s=2)
    assert greedy.gap > 0.15
    assert better.gap < 0.12
