"""Candidate tasks of agents."""

import numpy as np
import pytest
import torch
from boards import layout

from alloc.problems import Family, Instance, paper_like, random_instance
from alloc.problems.game import Board
from alloc.problems.game.candidates import AMPLE, candidate_tasks


@pytest.fixture(params=range(4))
def spread(request: pytest.FixtureRequest) -> Instance:
    """Twenty tasks, forty agents with places, ranges and start tasks that need not be near."""
    rng = np.random.default_rng([7, request.param])
    return Instance(
        ability=rng.integers(1, 11, 40),
        workload=rng.integers(1, 20, 20) * (rng.random(20) < 0.9),
        task_position=rng.random((20, 2)),
        agent_position=rng.random((40, 2)),
        start_task=rng.integers(-1, 20, 40),
        communication_range=rng.uniform(0.3, 1.0, 40),
    )


def test_nearest_candidates_match_hand_calculation() -> None:
    """Of five tasks on a line, an agent at 0 has the two nearest allowed tasks with workload."""
    instance = Instance(
        ability=[1],
        workload=[1, 0, 1, 1, 1],
        task_position=[[0.1, 0], [0.2, 0], [0.3, 0], [0.4, 0], [0.5, 0]],
        agent_position=[[0, 0]],
        allowed_tasks=[[1, 2, 3, 4]],
    )
    goal, distance, _, legal = candidate_tasks(instance, 2, None)
    assert goal.tolist() == [[2, 3, 5]]
    assert distance.tolist() == [[pytest.approx(0.3), pytest.approx(0.4), 0]]
    assert legal.all()


def test_padding_candidates_are_illegal() -> None:
    """An agent with fewer tasks than candidates has padding candidates that are illegal."""
    instance = Instance(ability=[1], workload=[1, 1, 1], allowed_tasks=[[1]])
    goal, _, _, legal = candidate_tasks(instance, 2, None)
    assert goal[legal].tolist() == [1, 3]


def test_candidates_are_distinct(spread: Instance) -> None:
    """No agent has a task twice, and idleness comes last."""
    goal, _, _, legal = candidate_tasks(spread, 6, None)
    for row, allowed in zip(goal, legal, strict=True):
        assert len(set(row[allowed])) == allowed.sum()
    assert (goal[:, -1] == spread.m).all()


def test_candidates_include_start_and_plan(spread: Instance) -> None:
    """The start task of an agent and its task in a plan are among its candidates."""
    plan = np.random.default_rng(0).integers(-1, spread.m, spread.n)
    goal, _, _, _ = candidate_tasks(spread, 3, plan)
    for wanted in (spread.start_task, plan):
        assert all(task in row for task, row in zip(wanted, goal, strict=True) if task >= 0)


@pytest.mark.parametrize("near", [20, 25, None])
def test_board_is_dense_with_enough_candidates(spread: Instance, near: int | None) -> None:
    """With as many candidates as tasks the board is the dense one."""
    dense, board = layout(spread), layout(spread, near=near)
    for name in Board.__dataclass_fields__:
        assert torch.equal(getattr(dense, name), getattr(board, name)), name


def test_sparse_candidates_match_the_dense_board(spread: Instance) -> None:
    """Candidates have the distance, up to the scale, and the legality of the dense board."""
    goal, distance, _, legal = candidate_tasks(spread, 6, None)
    _, far, _, able = candidate_tasks(spread, None, None)
    rows = np.arange(spread.n)[:, None]
    assert (legal <= able[rows, goal]).all()
    np.testing.assert_array_equal(distance[legal], far[rows, goal][legal])


def test_isolated_tasks_have_candidate_agents() -> None:
    """A task far from all agents is a candidate of the nearest agents, with ample ability."""
    place = np.column_stack([np.linspace(0, 1, 30), np.zeros(30)])
    sites = np.vstack([np.column_stack([np.linspace(0, 1, 11), np.zeros(11)]), [[1.0, 9.0]]])
    instance = Instance(ability=np.ones(30), workload=np.ones(12), task_position=sites, agent_position=place)
    goal, _, _, legal = candidate_tasks(instance, 4, None)
    able = ((goal == 11) & legal).any(axis=1)
    assert able.sum() == np.ceil(AMPLE * 30 / 12)
    assert able[25:].all()


def test_every_task_that_can_be_served_is_a_candidate() -> None:
    """On clustered sites every reachable task is a candidate of some agent."""
    for seed in range(5):
        family = Family(agents=120, tasks=40, starts="own", sites="clustered", dimensions=2)
        instance = random_instance(family, seed)
        goal, _, _, legal = candidate_tasks(instance, 8, None)
        assert set(range(40)) <= set(goal[legal].tolist())


def test_sparse_candidates_on_paper_instances() -> None:
    """All agents start at their start tasks on sparse and dense boards."""
    instance = paper_like(50, 20, 210, 0)
    for board in (layout(instance), layout(instance, near=5)):
        start = board.candidates.gather(2, board.start[..., None])[0, :, 0]
        assert start.tolist() == instance.start_task.tolist()
