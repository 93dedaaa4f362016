"""DDPG: the relaxation and its gradient (18) match finite differences, and probe games are solved."""

import pytest
import torch
from probes import PROBES, probe, share_learned
from resuming import assert_resumes_elsewhere

from alloc.allocators.learned.algorithms.ddpg import Ddpg, entropy_of, polyak_update, relaxed_action, relaxed_value
from alloc.allocators.learned.algorithms.hyperparameters import DdpgParameters
from alloc.problems.game import PLANNING, State, reset

GAIN = torch.tensor([[1.0, -torch.inf, 0.5, 0.0]], dtype=torch.float64)
QUALITY = torch.tensor([[2.0, -torch.inf, 5.0, 0.0]], dtype=torch.float64)


def test_relaxed_actions_match_hand_calculation() -> None:
    """A softmax with a temperature and probability 0 of closed bids; at low temperature the best bid has all of it."""
    e = torch.tensor([2.0, 1.0, 0.0], dtype=torch.float64).exp()
    assert relaxed_action(GAIN, 0.5)[0, [0, 2, 3]].tolist() == pytest.approx((e / e.sum()).tolist())
    assert relaxed_action(GAIN, 0.5)[0, 1] == 0
    assert relaxed_action(GAIN, 0.01)[0, 0] == pytest.approx(1.0)


def test_value_of_relaxed_actions_is_multilinear() -> None:
    """At a corner it is the value of that bid, between corners their weighted mean."""
    corners = torch.eye(4, dtype=torch.float64)[[0, 2, 3]]
    assert relaxed_value(corners, QUALITY.expand(3, -1)).tolist() == [2.0, 5.0, 0.0]
    assert relaxed_value(corners.mean(0, keepdim=True), QUALITY).item() == pytest.approx(7 / 3)


def test_gradient_matches_finite_differences() -> None:
    """(18): the gradient through the relaxed action agrees with finite differences."""
    scores = GAIN.clone().requires_grad_()
    relaxed_value(relaxed_action(scores, 0.7), QUALITY).sum().backward()
    for column in (0, 2, 3):
        nudge = torch.zeros_like(GAIN)
        nudge[0, column] = 1e-6
        rise = relaxed_value(relaxed_action(GAIN + nudge, 0.7), QUALITY)
        rise = (rise - relaxed_value(relaxed_action(GAIN - nudge, 0.7), QUALITY)) / 2e-6
        assert scores.grad is not None
        assert scores.grad[0, column].item() == pytest.approx(rise.item(), abs=1e-7)


def test_entropy_matches_hand_calculation_with_a_finite_gradient() -> None:
    """Two equal shares have entropy log 2; the gradient is finite for closed bids."""
    scores = torch.tensor([[1.0, -torch.inf, 1.0]]).requires_grad_()
    entropy = entropy_of(relaxed_action(scores, 1.0))
    assert entropy.item() == pytest.approx(0.6931472)
    entropy.sum().backward()
    assert scores.grad is not None
    assert torch.isfinite(scores.grad).all()


def test_targets_match_the_definition() -> None:
    """The target critic values the target actor's relaxed action; without an open bid, the target is the reward."""
    learner = Ddpg(parameters=DdpgParameters(gamma=0.5, softmax_temperature=1.0))
    for parameter in learner.targets.parameters():
        torch.nn.init.zeros_(parameter)
    torch.nn.init.constant_(learner.targets["critic"].local[-1].bias, 6.0)
    board = probe("right_task").board[torch.arange(1)]  # two bids are open: the other task, and being idle
    state = reset(board)
    none = State(**{**vars(state), "visited": torch.ones_like(state.visited)})
    assert learner.td_targets(board, state, torch.ones(1), PLANNING).item() == pytest.approx(1 + 0.5 * 2 / 3 * 6)
    assert learner.td_targets(board, none, torch.ones(1), PLANNING).item() == 1.0


def test_polyak_updates_match_hand_calculation() -> None:
    """With tau = 0.1 a weight moves by a tenth of the difference."""
    old, new = torch.nn.Linear(1, 1), torch.nn.Linear(1, 1)
    for network, value in ((old, 1.0), (new, 2.0)):
        for parameter in network.parameters():
            torch.nn.init.constant_(parameter, value)
    polyak_update(old, new, 0.1)
    assert old.weight.item() == pytest.approx(1.1)
    assert new.weight.item() == 2.0


def test_job_depends_only_on_state_and_job() -> None:
    """Stored with its replay buffer and restored in another learner, training continues bit for bit."""
    assert_resumes_elsewhere(Ddpg)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBES)
def test_ddpg_solves_probes(name: str) -> None:
    """All games with known answers are solved."""
    learner = Ddpg(parameters=DdpgParameters(learning_rate=3e-3, replay_ratio=8.0, tau=0.05, ent_coef=1.0))
    assert share_learned(learner, name, decisions=60) == 1.0
