"""DDPG: the relaxation and its gradient (18) against finite differences, and probe games with known answers."""

import pytest
import torch
from probes import PROBES, probe, share_learned
from same_lesson import assert_taken_up_elsewhere

from alloc.allocators.learned.algorithms.ddpg import (
    Ddpg,
    DdpgParameters,
    entropy_of,
    follow,
    shares_of,
    td_target,
    value_of_shares,
)
from alloc.problems.game import PLANNING, State, reset

GAIN = torch.tensor([[1.0, -torch.inf, 0.5, 0.0]], dtype=torch.float64)
QUALITY = torch.tensor([[2.0, -torch.inf, 5.0, 0.0]], dtype=torch.float64)


def test_shares_by_hand() -> None:
    """A softmax at a temperature; closed bids get nothing, and the colder, the nearer to the best bid alone."""
    e = torch.tensor([2.0, 1.0, 0.0], dtype=torch.float64).exp()
    assert shares_of(GAIN, 0.5)[0, [0, 2, 3]].tolist() == pytest.approx((e / e.sum()).tolist())
    assert shares_of(GAIN, 0.5)[0, 1] == 0
    assert shares_of(GAIN, 0.01)[0, 0] == pytest.approx(1.0)


def test_value_of_shares_is_multilinear() -> None:
    """At a corner it is the value of that bid, between corners the mean of their values."""
    corners = torch.eye(4, dtype=torch.float64)[[0, 2, 3]]
    assert value_of_shares(corners, QUALITY.expand(3, -1)).tolist() == [2.0, 5.0, 0.0]
    assert value_of_shares(corners.mean(0, keepdim=True), QUALITY).item() == pytest.approx(7 / 3)


def test_gradient_against_finite_differences() -> None:
    """(18): the gradient through the shares is what small changes of the scores show."""
    scores = GAIN.clone().requires_grad_()
    value_of_shares(shares_of(scores, 0.7), QUALITY).sum().backward()
    for column in (0, 2, 3):
        nudge = torch.zeros_like(GAIN)
        nudge[0, column] = 1e-6
        rise = value_of_shares(shares_of(GAIN + nudge, 0.7), QUALITY)
        rise = (rise - value_of_shares(shares_of(GAIN - nudge, 0.7), QUALITY)) / 2e-6
        assert scores.grad is not None
        assert scores.grad[0, column].item() == pytest.approx(rise.item(), abs=1e-7)


def test_entropy_by_hand_with_a_finite_gradient() -> None:
    """Two equal shares have log 2; the gradient is finite where a bid is closed."""
    scores = torch.tensor([[1.0, -torch.inf, 1.0]]).requires_grad_()
    entropy = entropy_of(shares_of(scores, 1.0))
    assert entropy.item() == pytest.approx(0.6931472)
    entropy.sum().backward()
    assert scores.grad is not None
    assert torch.isfinite(scores.grad).all()


def test_target_by_hand() -> None:
    """What follows counts unless the game is over."""
    reward, following, over = torch.tensor([1.0, 1.0]), torch.tensor([4.0, 4.0]), torch.tensor([False, True])
    assert td_target(reward, following, over, 0.5).tolist() == [3.0, 1.0]


def test_targets_of_states() -> None:
    """The target actor's shares weigh the target critic's values; with no open bid, nothing follows."""
    learner = Ddpg(parameters=DdpgParameters(discount=0.5, softness=1.0))
    for parameter in learner.targets.parameters():
        torch.nn.init.zeros_(parameter)
    torch.nn.init.constant_(learner.targets["critic"].local[-1].bias, 6.0)
    board = probe("right_task").board[torch.arange(1)]  # two bids are open: the other task, and being idle
    state = reset(board)
    none = State(**{**vars(state), "visited": torch.ones_like(state.visited)})
    assert learner.wanted(board, state, torch.ones(1), PLANNING).item() == pytest.approx(1 + 0.5 * 2 / 3 * 6)
    assert learner.wanted(board, none, torch.ones(1), PLANNING).item() == 1.0


def test_targets_follow_by_their_share() -> None:
    """Polyak: a tenth of the way is a tenth of the way."""
    old, new = torch.nn.Linear(1, 1), torch.nn.Linear(1, 1)
    for network, value in ((old, 1.0), (new, 2.0)):
        for parameter in network.parameters():
            torch.nn.init.constant_(parameter, value)
    follow(old, new, 0.1)
    assert old.weight.item() == pytest.approx(1.1)
    assert new.weight.item() == 2.0


def test_a_lesson_depends_on_state_and_lesson_only() -> None:
    """Stored with its memory between lessons and taken up by another learner, training goes on bit for bit."""
    assert_taken_up_elsewhere(Ddpg)


@pytest.mark.parametrize("name", PROBES)
def test_ddpg_solves_probes(name: str) -> None:
    """Games with known answers are solved, all of them."""
    learner = Ddpg(parameters=DdpgParameters(learning_rate=3e-3, reuse=8.0, target_share=0.05, entropy_weight=1.0))
    assert share_learned(learner, name, decisions=60) == 1.0
