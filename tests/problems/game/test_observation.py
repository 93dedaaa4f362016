"""Observations of agents."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from boards import EXTREMES, layout, state_of
from hypothesis import given
from hypothesis import strategies as st
from strategies import instances, rebuilt

from alloc.problems import Instance
from alloc.problems.game import (
    AGENT_FEATURES,
    PAIR_FEATURES,
    TASK_FEATURES,
    Board,
    Reward,
    Rules,
    action_mask,
    difference_rewards,
    grant_bids,
    marginal_contributions,
    observe_agents,
    observe_pairs,
    observe_tasks,
    reset,
    step,
    utility,
)

OBSERVE = (observe_pairs, observe_agents, observe_tasks)


def test_pair_features_match_hand_calculation(board: Board) -> None:
    """The third agent, of ability 1.5, at the first task, which has just the 2 it needs, bids for the second.

    That task needs 1 and has 1; the agent is 0.2 away from its own and 0.8 from that one, times 1.65.
    Energy weighs 0.5.
    """
    seen = observe_pairs(board, reset(board))[0, 2, 1].tolist()
    assert seen == pytest.approx(
        [
            0 / 1.5 / 3,  # shortfall there over what it brings
            -1.0,  # shortfall there once it is there
            0 / 1.5 / 3,  # shortfall at its own task
            1.0,  # shortfall at its own task once it is gone
            0 / 1,  # shortfall there over the need
            -1.5,
            0 / 2,
            1.5 / 2,
            0.6 * 1.65,  # farther
            0.8 * 1.65,
            0.5 * 0.6 * 1.65,  # its energy_weight
            0.5 - 1,
            np.log(1) - 1.5,
            np.log(2) - 1.5,
            1.5 - 1,
            -1.5 / 1.5,  # the shortfall grows by all of its ability
            -1.5,
            0.0,  # not the place of the idle
            np.log(1.5) / 2 - 1,  # supply of its own task
            np.log(2.5) / 2 - 1,  # and of the other
            1.0,  # both are in its reach
            0.0,  # it brings all of its ability
        ],
        abs=1e-6,
    )


def test_agent_features_match_hand_calculation(board: Board) -> None:
    """The second agent, of ability 1, is alone at the second task, 0.1 * 1.65 away, which needs 1."""
    seen = observe_agents(board, reset(board))[0, 1].tolist()
    assert seen == pytest.approx([0, 0, 1, 1, 0.165, 0.0825, 1, 0], abs=1e-6)


def test_task_features_match_hand_calculation(board: Board) -> None:
    """Groups of 0.5 for 2 and of 2.5 for 1: short by 1.5 of 3 and by half of the mean, with a surplus of 1.5."""
    seen = observe_tasks(board, state_of(board, np.array([0, 1, 1])))[0]
    short = [0.75, 0.5, 2, np.log(2) - 1.5, 0.5 - 1, np.log(2) - 1.5, 0]
    everywhere = [0.25, 2, 0, -0.5]
    assert seen[0].tolist() == pytest.approx([*short, *everywhere, np.log(1.5) / 2 - 1], abs=1e-6)
    ample = [-1.5, -0.5, -2, -1.5, 2.5 / 2 - 1, np.log(3) - 1.5, 0]
    assert seen[1].tolist() == pytest.approx([*ample, *everywhere, np.log(2.5) / 2 - 1], abs=1e-6)
    assert seen[2, 6].item() == 1


@given(instances(), st.integers(0, 99))
def test_observations_are_finite_and_bounded(instance: Instance, seed: int) -> None:
    """Features are within -2 and 2, also of idle agents and of tasks without workload."""
    board = layout(instance)
    state = reset(board)
    draws = torch.rand(board.shape, generator=torch.Generator().manual_seed(seed))
    state = step(board, state, draws.masked_fill(~action_mask(board, state), -1.0).argmax(2))
    _check(board, state)


def _check(board: Board, state) -> None:
    (batch, n, c), places = board.shape, board.places
    shapes = (batch, n, c, PAIR_FEATURES), (batch, n, AGENT_FEATURES), (batch, places, TASK_FEATURES)
    for observe, shape in zip(OBSERVE, shapes, strict=True):
        seen = observe(board, state)
        assert seen.shape == shape
        assert bool((seen.abs() <= 2).all())


@pytest.mark.parametrize("name", EXTREMES)
@pytest.mark.parametrize("hours", [0.0, 1e-300, 1.0, 1e300])
@pytest.mark.parametrize("reward", list(Reward))
@pytest.mark.parametrize("flying", [False, True])
def test_extremes_stay_finite(name: str, hours: float, reward: Reward, flying: bool) -> None:
    """For extreme numbers, no feature and no reward is NaN or infinite."""
    rules, board = Rules(reward=reward, flying=flying), layout(EXTREMES[name], hours=hours)
    state, generator = reset(board), torch.Generator().manual_seed(0)
    for _ in range(3):
        _check(board, state)
        bids = torch.rand(board.shape, generator=generator).masked_fill(~action_mask(board, state, rules), -torch.inf)
        slot = torch.where(bids.amax(2) > 0, bids.argmax(2), state.slot)
        granted = grant_bids(board, state, bids, torch.tensor([0.1]))
        for rewards in (
            utility(board, state, rules),
            marginal_contributions(board, state, granted, rules),
            difference_rewards(board, state, slot, rules),
        ):
            assert bool(torch.isfinite(rewards).all())
        state = step(board, state, slot)


@given(instances(speeds=False), st.integers(0, 99))
def test_observations_are_permutation_equivariant(instance: Instance, seed: int) -> None:
    """Permuting agents and tasks permutes the observations."""
    # a start task without a position would be lost in the relabelled instance
    instance = replace(instance, task_position=np.nan_to_num(instance.task_position))
    rng = np.random.default_rng(seed)
    agents, tasks = rng.permutation(instance.n), rng.permutation(instance.m)
    plan = np.full(instance.n, -1)
    board = layout(instance, plan=plan)
    other = layout(rebuilt(instance, agents, tasks), plan=plan)
    places = [*tasks.tolist(), instance.m]
    one, two = observe_pairs(board, reset(board)), observe_pairs(other, reset(other))
    torch.testing.assert_close(one[0][agents][:, places], two[0], rtol=1e-4, atol=1e-4)
