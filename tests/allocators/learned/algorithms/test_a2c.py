"""A2C: returns match the definition and gradients hand calculation, and probe games are solved."""

import pytest
import torch
from probes import PROBES, probe, share_learned
from resuming import assert_resumes_elsewhere, weights

from alloc.allocators.learned.algorithms.a2c import A2c, n_step_returns
from alloc.allocators.learned.algorithms.hyperparameters import A2cParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.play.action_sampling import log_probabilities
from alloc.allocators.learned.play.trajectories import collect
from alloc.problems.game import PAPER, PLANNING, Rules, TurnRule, apply_moves, reset, step


def test_returns_match_the_definition() -> None:
    """Q is the discounted sum of future rewards and the value of the last state."""
    reward, alive = torch.tensor([[1.0], [2.0], [4.0]]), torch.ones(3, 1, dtype=torch.bool)
    got = n_step_returns(reward, alive, torch.tensor([8.0]), 0.5)
    assert got[:, 0].tolist() == [1 + 0.5 * 2 + 0.25 * 4 + 0.125 * 8, 2 + 0.5 * 4 + 0.25 * 8, 4 + 0.5 * 8]


def test_no_return_beyond_the_end_of_a_game() -> None:
    """The last step of a game has only its own reward, whatever is stored after it."""
    reward = torch.tensor([[1.0], [2.0], [99.0]])
    alive = torch.tensor([[True], [True], [False]])
    assert n_step_returns(reward, alive, torch.tensor([77.0]), 0.5)[:, 0].tolist() == [2.0, 2.0, 0.0]


@pytest.mark.parametrize("rules", [PLANNING, Rules(turn=TurnRule.SIMULTANEOUS), PAPER])
def test_segments_continue_each_other(rules: Rules) -> None:
    """Continuing from the state after a segment gives the same rewards as one long game."""
    board = probe("pairing").board
    learner, generator = A2c(), torch.Generator().manual_seed(0)
    first = collect(learner.network, board, 1, generator, rules)
    state = step(
        board, first.state[torch.tensor(0)], apply_moves(board, first.state[torch.tensor(0)], first.actions[0])
    )
    second = collect(learner.network, board, 2, generator, rules, state=state)
    assert torch.equal(second.state.slot[0], state.slot)
    assert torch.equal(second.state.done[0], state.done)
    assert not torch.equal(second.state.slot[0], reset(board).slot)


def test_probabilities_follow_advantages() -> None:
    """One update raises the probability of actions with positive advantage, and lowers that of others."""
    board = probe("right_task").board
    for sign in (1.0, -1.0):
        learner = A2c(parameters=A2cParameters(ent_coef=0.0, vf_coef=0.0))
        played = collect(learner.network, board, 1, torch.Generator().manual_seed(0), PLANNING)
        told = type(played)(**{**vars(played), "reward": 10 * sign * torch.ones_like(played.reward)})
        told = type(told)(**{**vars(told), "last_value": torch.zeros_like(told.last_value)})
        learner.update(told, PLANNING)
        now = learner.network(board, reset(board))
        again, _ = log_probabilities(board, reset(board), now, played.actions[0], PLANNING)
        assert torch.sign((again - played.log_probability[0]).sum()).item() == sign


def test_job_depends_only_on_state_and_job() -> None:
    """Stored between jobs and restored in another learner, training continues bit for bit."""
    assert_resumes_elsewhere(A2c)


def test_simultaneous_turns_can_be_trained() -> None:
    """The paper's turn rule works, and weights stay finite."""
    learner = A2c()
    before = weights(learner)
    report = learner.train_on(TrainingJob(0, 50, curriculum=probe("pairing"), rules=Rules(turn=TurnRule.SIMULTANEOUS)))
    assert report.decisions >= 50
    assert torch.isfinite(weights(learner)).all()
    assert not torch.equal(weights(learner), before)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBES)
def test_a2c_solves_probes(name: str) -> None:
    """All games with known answers are solved."""
    assert share_learned(A2c(), name) == 1.0
