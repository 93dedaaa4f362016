"""Reach: distances and reachability agree with plain loops."""

import numpy as np
import pytest
from hypothesis import given
from oracle import reachable
from strategies import instances

from alloc.problems import Instance
from alloc.problems.distances.metric import BLOCK


@given(instances())
def test_reach_matches_plain_loops(instance: Instance) -> None:
    """Every distance and every permission is that of its agent, although agents share rows."""
    distance, able = reachable(instance)
    reach = instance.reach
    assert reach.distance[reach.origin] == pytest.approx(distance)
    assert (reach.mask[reach.origin] == able).all()
    assert reach.is_complete == able.all()
    agents, tasks = np.indices((instance.n, instance.m)).reshape(2, -1)
    assert (reach.allows(agents, tasks) == able.ravel()).all()
    assert reach.distance_of(agents, tasks) == pytest.approx(distance.ravel())


def test_identical_agents_share_an_origin() -> None:
    """Place, range, battery and list make an origin; 0.0 and -0.0, or two unknown places, are one."""
    nan = float("nan")
    instance = Instance(
        ability=np.ones(6),
        workload=[1, 1],
        task_position=[[0, 0], [1, 1]],
        agent_position=[[0, 0], [-0.0, 0], [nan, nan], [nan, nan], [0, 0], [0, 0]],
        battery=[1, 1, 1, 1, 2, 1],
        allowed_tasks=[None, None, None, None, None, [0, 1]],
    )
    assert [len(set(instance.reach.origin[list(pair)])) for pair in ((0, 1), (2, 3), (0, 2), (0, 4), (0, 5))] == [
        1, 1, 2, 2, 2
    ]  # fmt: skip


@pytest.mark.parametrize("field", ["communication_range", "battery"])
def test_limits_have_a_tolerance(field: str) -> None:
    """A task at 1 + 1e-10 is within a limit of 1; one at 1 + 1e-8 is not."""
    instance = Instance(
        ability=[1],
        workload=[1, 1],
        agent_position=[[0, 0]],
        task_position=[[1 + 1e-10, 0], [1 + 1e-8, 0]],
        **{field: [1]},
    )
    assert instance.reach.mask.tolist() == [[True, False]]


def test_distances_do_not_depend_on_blocks() -> None:
    """Distances computed in several blocks equal single ones."""
    rng = np.random.default_rng(0)
    agents, tasks = rng.random((BLOCK // 100, 3)), rng.random((250, 3))
    instance = Instance(ability=np.ones(len(agents)), workload=np.ones(250), agent_position=agents, task_position=tasks)
    for i in (0, 261, 262, len(agents) - 1):
        expected = np.linalg.norm(agents[i] - tasks, axis=1)
        assert instance.reach.distance[instance.reach.origin[i]] == pytest.approx(expected, rel=1e-14)


def test_shared_arrays_are_read_only() -> None:
    """Shared arrays are read-only."""
    with pytest.raises(ValueError, match="read-only"):
        Instance(ability=[1], workload=[1]).reach.mask[0, 0] = False
