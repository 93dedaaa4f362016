"""Parts of an instance: who is near whom, in space or by the ways that agents can go."""

import numpy as np
import pytest
import scipy.sparse

from alloc.allocators.learned.search.regions import cover, links_between
from alloc.problems import IDLE, Instance
from alloc.problems.game.candidates import near_tasks


@pytest.mark.parametrize("seed", range(20))
def test_cover_partitions_tasks_into_neighbours(seed: int) -> None:
    """Groups are of one size and share no task; all tasks are in one, but for fewer than a group."""
    rng = np.random.default_rng(seed)
    m, size = int(rng.integers(1, 30)), int(rng.integers(1, 6))
    size = min(size, m)
    groups = cover(rng.random((m, 3)), np.zeros(m), size, rng)
    assert groups.shape == (m // size, size)
    assert len(np.unique(groups)) == groups.size


@pytest.mark.parametrize("seed", range(20))
def test_cover_is_about_what_is_lacking(seed: int) -> None:
    """Where something is lacking, each group has a task that lacks, and as much to spare as is left within its size."""
    rng = np.random.default_rng(seed)
    m, size = int(rng.integers(4, 30)), int(rng.integers(2, 5))
    surplus = rng.integers(-3, 4, m).astype(float)
    surplus[0] = -1.0
    groups = cover(rng.random((m, 3)), surplus, size, rng)
    assert len(np.unique(groups)) == groups.size
    spare = set(np.flatnonzero(surplus > 0).tolist())
    for group in groups.tolist():
        assert (surplus[group] < 0).any()
        if spare:
            assert spare & set(group), "help was left, and none was taken in"
        spare -= set(group)


def test_cover_brings_lack_and_surplus_together() -> None:
    """The nearest that can help come along, however far they are, and no more of them than are needed."""
    place = np.arange(10.0)[:, None] * [1.0, 0.0, 0.0]
    surplus = np.zeros(10)
    surplus[[0, 7, 8, 9]] = [-2.5, 2.0, 1.0, 5.0]
    groups = cover(place, surplus, 4, np.random.default_rng(0))
    assert groups.shape == (1, 4)
    assert {0, 7, 8} < set(groups[0].tolist())
    assert 9 not in groups[0]
    assert set(cover(place, surplus, 2, np.random.default_rng(0))[0].tolist()) in ({0, 7}, {0, 8}, {0, 9})


def test_cover_groups_near_tasks() -> None:
    """Two far clusters of four are never mixed."""
    place = np.repeat([[0.0, 0, 0], [9.0, 0, 0]], 4, axis=0) + 0.1 * np.random.default_rng(0).random((8, 3))
    for seed in range(20):
        groups = cover(place, np.zeros(8), 4, np.random.default_rng(seed))
        assert sorted(map(sorted, groups.tolist())) == [[0, 1, 2, 3], [4, 5, 6, 7]]


@pytest.mark.parametrize("scale", [1e-300, 1e300])
def test_cover_survives_every_position(scale: float) -> None:
    """Unknown, huge and tiny positions make groups that share no task."""
    rng = np.random.default_rng(0)
    place = scale * rng.uniform(-1, 1, (12, 3))
    place[3] = np.nan
    groups = cover(place, np.zeros(12), 3, rng)
    assert sorted(groups.ravel().tolist()) == list(range(12))


def chain(*pairs: tuple[int, int], m: int) -> scipy.sparse.csr_array:
    """Return links of length 1."""
    start, end = np.array(pairs).T
    return scipy.sparse.csr_array((np.ones(len(pairs)), (start, end)), shape=(m, m))


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_cover_follows_the_ways_to_a_surplus(size: int) -> None:
    """What is nearest in space cannot come; what can come over others brings these along, if there is room."""
    place = np.arange(6.0)[:, None] * [1.0, 0.0, 0.0]
    surplus = np.array([-1.0, 4.0, 0.0, 0.0, 0.0, 2.0])
    links = chain((0, 3), (3, 4), (4, 5), (5, 0), (2, 1), m=6)
    for seed in range(20):
        group = set(cover(place, surplus, size, np.random.default_rng(seed), links=links)[0].tolist())
        along = [0, 3, 4, 5]
        assert set(along[:size]) <= group, "what is linked comes first, and in this order"


def test_cover_leaves_others_their_tasks() -> None:
    """Two tasks that lack some, and one way for both: no task is in two parts."""
    links = chain((0, 1), (2, 1), (1, 3), m=4)
    for seed in range(20):
        groups = cover(np.zeros((4, 3)), np.array([-1.0, 0, -1.0, 5.0]), 2, np.random.default_rng(seed), links=links)
        assert len(np.unique(groups)) == groups.size


def test_cover_takes_links_for_lack_alone() -> None:
    """Where nothing is lacking, and for places without links, parts are of neighbours in space."""
    place = np.repeat([[0.0, 0, 0], [9.0, 0, 0]], 2, axis=0)
    links = chain((0, 3), (3, 0), (1, 2), (2, 1), m=4)
    groups = cover(place, np.zeros(4), 2, np.random.default_rng(0), links=links)
    assert sorted(map(sorted, groups.tolist())) == [[0, 1], [2, 3]]
    alone = scipy.sparse.csr_array((4, 4))
    assert cover(place, np.array([0.0, 0, -1, 0]), 2, np.random.default_rng(0), links=alone).tolist() == [[2, 3]]


def test_links_lead_to_those_who_could_come() -> None:
    """An edge leads from a task to where somebody is who may work at it; who is idle, or there already, makes none."""
    instance = Instance(
        ability=[1, 1, 1, 1],
        workload=[1, 1, 1],
        agent_position=[[0, 0], [1, 0], [1, 0], [2, 0]],
        task_position=[[0, 0], [1, 0], [2, 0]],
        communication_range=[1, 1, 0, 1],
    )
    plan = np.array([0, 1, 1, IDLE])
    links = links_between(near_tasks(instance, 3, None), plan, 3, np.random.default_rng(0)).toarray()
    assert (links > 0).tolist() == [[False, True, False], [True, False, False], [False, True, False]]
