"""The Markov game: its rules, its rewards, and what agents see."""

import numpy as np
import pytest
import torch

from alloc.problems import Instance
from alloc.problems.game import (
    PAIR_FEATURES,
    TASK_FEATURES,
    Board,
    begin,
    flown,
    illegal_actions,
    make_board,
    observe_pairs,
    observe_tasks,
    potential,
    step,
    value_of,
)


@pytest.fixture
def instance() -> Instance:
    return Instance(
        ability=[1, 2, 3],
        workload=[4, 2],
        task_position=[[0, 0], [1, 0]],
        agent_position=[[0, 0], [0.9, 0], [0.2, 0]],
        communication_range=[0.5, 5, 5],
    )


@pytest.fixture
def board(instance: Instance) -> Board:
    return make_board([instance], [1.0], [0.5], np.random.default_rng(0))


def test_agents_begin_at_the_nearest_task_in_reach(board: Board) -> None:
    """Without a start task, an agent begins where it has least to fly."""
    assert board.start.tolist() == [[0, 1, 0]]


def test_a_start_task_is_where_an_agent_begins() -> None:
    """A start task counts, unless the agent cannot take it; who can take nothing is idle."""
    instance = Instance(
        ability=[1, 1, 1],
        workload=[1, 1],
        task_position=[[0, 0], [1, 0]],
        start_task=[1, 1, 0],
        allowed_tasks=[None, [0], []],
    )
    assert make_board([instance], [1.0], [0.5], np.random.default_rng(0)).start.tolist() == [[1, 0, 2]]


def test_units(board: Board) -> None:
    """Abilities and targets are in units of the mean ability, 2 here; distances have a mean of 0.66 where legal."""
    assert board.ability.tolist() == [[0.5, 1.0, 1.5]]
    assert board.target.tolist() == [[2.0, 1.0, 1.0]]
    legal = board.legal[0, :, :2]
    assert board.distance[0, :, :2][legal].mean().item() == pytest.approx(0.66)


def test_step_moves_ability(board: Board) -> None:
    """A granted bid takes the agent's ability from one task to the other, and nothing else changes."""
    state = begin(board)
    assert state.group.tolist() == [[2.0, 1.0, 0.0]]
    after = step(board, state, torch.tensor([2 * 3 + 1]))
    assert after.task.tolist() == [[0, 1, 1]]
    assert after.group.tolist() == [[0.5, 2.5, 0.0]]
    assert not after.done.any()


def test_stopping_ends_the_game(board: Board) -> None:
    """After a stop, further bids change nothing."""
    stopped = step(board, begin(board), torch.tensor([9]))
    assert stopped.done.all()
    assert step(board, stopped, torch.tensor([2 * 3 + 1])).task.tolist() == [[0, 1, 0]]


def test_illegal_actions(board: Board) -> None:
    """Staying and tasks out of range are barred; being idle and stopping are not."""
    barred = illegal_actions(board, begin(board))[0].tolist()
    stay_or_far = [True, True, False, False, True, False, True, False, False]
    assert barred == [*stay_or_far, False]


def test_potential_by_hand(board: Board) -> None:
    """With shortfalls of 1.5 of 2 and 0 of 1, the potential is -4 * 1.5/3 - 2 * 0.75/2 - 0.75."""
    state = step(board, begin(board), torch.tensor([2 * 3 + 1]))
    assert potential(board, state).item() == pytest.approx(-2 - 0.75 - 0.75)
    assert potential(board, begin(board)).item() == 0


def test_reward_telescopes_to_the_plan(board: Board) -> None:
    """Going back and forth brings nothing: energy is that of the final task, flown directly."""
    start = begin(board)
    there = step(board, start, torch.tensor([2 * 3 + 1]))
    back = step(board, there, torch.tensor([2 * 3 + 0]))
    assert flown(board, there).item() > flown(board, start).item()
    assert value_of(board, back).item() == pytest.approx(value_of(board, start).item())


def test_observations_are_finite_and_bounded(board: Board) -> None:
    """Features stay within -2 and 2, also of idle agents and of tasks without workload."""
    state = step(board, begin(board), torch.tensor([0 * 3 + 2]))
    pairs, tasks = observe_pairs(board, state), observe_tasks(board, state)
    assert pairs.shape == (1, 3, 3, PAIR_FEATURES)
    assert tasks.shape == (1, 3, TASK_FEATURES)
    for seen in (pairs, tasks):
        assert torch.isfinite(seen).all()
        assert seen.abs().max() <= 2


def test_scale_does_not_matter(instance: Instance) -> None:
    """Other units of work and distance give the same observations."""
    scaled = Instance(
        ability=instance.ability * 10,
        workload=instance.workload * 10,
        task_position=instance.task_position * 7,
        agent_position=instance.agent_position * 7,
        communication_range=instance.communication_range * 7,
    )
    boards = [make_board([each], [1.0], [0.5], np.random.default_rng(0)) for each in (instance, scaled)]
    one, other = (observe_pairs(each, begin(each)) for each in boards)
    torch.testing.assert_close(one, other)
