"""Partitions into regions, by distance or by reachability."""

import numpy as np
import pytest
import scipy.sparse

from alloc.allocators.learned.search.regions import partition, reach_graph
from alloc.problems import IDLE, Instance
from alloc.problems.game.candidates import candidate_tasks


@pytest.mark.parametrize("seed", range(20))
def test_tasks_are_partitioned(seed: int) -> None:
    """Regions are disjoint and of one size; fewer tasks than a region remain."""
    rng = np.random.default_rng(seed)
    m, size = int(rng.integers(1, 30)), int(rng.integers(1, 6))
    size = min(size, m)
    regions = partition(rng.random((m, 3)), np.zeros(m), size, rng)
    assert regions.shape == (m // size, size)
    assert len(np.unique(regions)) == regions.size


@pytest.mark.parametrize("seed", range(20))
def test_regions_are_built_around_shortfalls(seed: int) -> None:
    """With shortfalls, each region has one, and a surplus as long as there are any."""
    rng = np.random.default_rng(seed)
    m, size = int(rng.integers(4, 30)), int(rng.integers(2, 5))
    surplus = rng.integers(-3, 4, m).astype(float)
    surplus[0] = -1.0
    regions = partition(rng.random((m, 3)), surplus, size, rng)
    assert len(np.unique(regions)) == regions.size
    spare = set(np.flatnonzero(surplus > 0).tolist())
    for group in regions.tolist():
        assert (surplus[group] < 0).any()
        if spare:
            assert spare & set(group), "a surplus was left, and the region has none"
        spare -= set(group)


def test_shortfall_and_surplus_are_in_one_region() -> None:
    """A region has the nearest tasks with a surplus, however far, and no more of them than needed."""
    place = np.arange(10.0)[:, None] * [1.0, 0.0, 0.0]
    surplus = np.zeros(10)
    surplus[[0, 7, 8, 9]] = [-2.5, 2.0, 1.0, 5.0]
    regions = partition(place, surplus, 4, np.random.default_rng(0))
    assert regions.shape == (1, 4)
    assert {0, 7, 8} < set(regions[0].tolist())
    assert 9 not in regions[0]
    assert set(partition(place, surplus, 2, np.random.default_rng(0))[0].tolist()) in ({0, 7}, {0, 8}, {0, 9})


def test_regions_contain_nearby_tasks() -> None:
    """Two distant clusters of four tasks are never mixed."""
    place = np.repeat([[0.0, 0, 0], [9.0, 0, 0]], 4, axis=0) + 0.1 * np.random.default_rng(0).random((8, 3))
    for seed in range(20):
        regions = partition(place, np.zeros(8), 4, np.random.default_rng(seed))
        assert sorted(map(sorted, regions.tolist())) == [[0, 1, 2, 3], [4, 5, 6, 7]]


@pytest.mark.parametrize("scale", [1e-300, 1e60])
def test_regions_are_disjoint_for_any_positions(scale: float) -> None:
    """Unknown, huge and tiny positions give disjoint regions."""
    rng = np.random.default_rng(0)
    place = scale * rng.uniform(-1, 1, (12, 3))
    place[3] = np.nan
    regions = partition(place, np.zeros(12), 3, rng)
    assert sorted(regions.ravel().tolist()) == list(range(12))


def edges(*pairs: tuple[int, int], m: int) -> scipy.sparse.csr_array:
    """Return a graph of edges of length 1."""
    start, end = np.array(pairs).T
    return scipy.sparse.csr_array((np.ones(len(pairs)), (start, end)), shape=(m, m))


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_regions_follow_paths_to_a_surplus(size: int) -> None:
    """If the nearest surplus is out of reach, one reachable via other tasks brings these along if there is room."""
    place = np.arange(6.0)[:, None] * [1.0, 0.0, 0.0]
    surplus = np.array([-1.0, 4.0, 0.0, 0.0, 0.0, 2.0])
    graph = edges((0, 3), (3, 4), (4, 5), (5, 0), (2, 1), m=6)
    for seed in range(20):
        group = set(partition(place, surplus, size, np.random.default_rng(seed), graph=graph)[0].tolist())
        along = [0, 3, 4, 5]
        assert set(along[:size]) <= group, "tasks on the path come first, and in this order"


def test_regions_share_no_task_of_a_path() -> None:
    """If two shortfalls have the same path, no task is in two regions."""
    graph = edges((0, 1), (2, 1), (1, 3), m=4)
    for seed in range(20):
        regions = partition(
            np.zeros((4, 3)), np.array([-1.0, 0, -1.0, 5.0]), 2, np.random.default_rng(seed), graph=graph
        )
        assert len(np.unique(regions)) == regions.size


def test_graph_is_used_only_for_shortfalls() -> None:
    """Without a shortfall or edges, regions consist of spatial neighbours."""
    place = np.repeat([[0.0, 0, 0], [9.0, 0, 0]], 2, axis=0)
    graph = edges((0, 3), (3, 0), (1, 2), (2, 1), m=4)
    regions = partition(place, np.zeros(4), 2, np.random.default_rng(0), graph=graph)
    assert sorted(map(sorted, regions.tolist())) == [[0, 1], [2, 3]]
    alone = scipy.sparse.csr_array((4, 4))
    assert partition(place, np.array([0.0, 0, -1, 0]), 2, np.random.default_rng(0), graph=alone).tolist() == [[2, 3]]


def test_edges_lead_to_tasks_whose_agents_can_take_the_task() -> None:
    """Edges lead to tasks whose agents can also take this one; idle agents and those of the task itself have none."""
    instance = Instance(
        ability=[1, 1, 1, 1],
        workload=[1, 1, 1],
        agent_position=[[0, 0], [1, 0], [1, 0], [2, 0]],
        task_position=[[0, 0], [1, 0], [2, 0]],
        communication_range=[1, 1, 0, 1],
    )
    plan = np.array([0, 1, 1, IDLE])
    graph = reach_graph(candidate_tasks(instance, 3, None), plan, 3, np.random.default_rng(0)).toarray()
    assert (graph > 0).tolist() == [[False, True, False], [True, False, False], [False, True, False]]
