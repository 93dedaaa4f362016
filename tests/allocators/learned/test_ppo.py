"""PPO: its formulas against numbers worked by hand, and that it learns."""

import numpy as np
import pytest
import torch

from alloc.allocators.learned.curriculum import Curriculum
from alloc.allocators.learned.gappo import new_member
from alloc.allocators.learned.network import ActorCritic
from alloc.allocators.learned.ppo import PpoParameters, adapt_learning_rate, advantages, collect, loss, update
from alloc.problems.game import begin, step, value_of


def advantage_by_definition(reward: list[float], value: list[float], last: float, g: float, s: float) -> list[float]:
    """The double sum of (9) over the errors of (10), as the paper writes it."""
    following = [*value[1:], last]
    error = [r + g * after - now for r, now, after in zip(reward, value, following, strict=True)]
    return [sum((g * s) ** (i - t) * error[i] for i in range(t, len(error))) for t in range(len(error))]


def test_advantages_match_the_definition() -> None:
    """The backward recursion gives the double sum of (9), a game that was cut off counting its last value."""
    generator = torch.Generator().manual_seed(0)
    reward, value = torch.randn(6, 1, generator=generator), torch.randn(6, 1, generator=generator)
    got = advantages(reward, value, torch.ones(6, 1, dtype=torch.bool), torch.tensor([0.7]), 0.9, 0.8)
    expected = advantage_by_definition(reward[:, 0].tolist(), value[:, 0].tolist(), 0.7, 0.9, 0.8)
    assert got[:, 0].tolist() == pytest.approx(expected)


def test_nothing_follows_the_end_of_a_game() -> None:
    """The step that stops a game sees neither later rewards nor later values."""
    reward = torch.tensor([[1.0], [2.0], [99.0]])
    value = torch.tensor([[0.5], [0.25], [77.0]])
    alive = torch.tensor([[True], [True], [False]])
    got = advantages(reward, value, alive, torch.tensor([0.0]), 1.0, 1.0)
    assert got[:, 0].tolist() == pytest.approx([1 + 2 - 0.5, 2 - 0.25, 0.0])


@pytest.mark.parametrize(
    ("ratio", "advantage", "surrogate"),
    [(1.5, 2.0, 1.2 * 2), (1.5, -2.0, 1.5 * -2), (0.5, 2.0, 0.5 * 2), (0.5, -2.0, 0.8 * -2), (1.1, 3.0, 3.3)],
)
def test_clipped_surrogate(ratio: float, advantage: float, surrogate: float) -> None:
    """(13) with epsilon 0.2: gains are clipped, losses are not."""
    zero = torch.zeros(1)
    got = loss(torch.tensor([ratio]), torch.tensor([advantage]), zero, zero, zero, PpoParameters())
    assert got.item() == pytest.approx(-surrogate)


def test_value_loss_and_entropy() -> None:
    """(15) is half the squared error, weighted; the entropy counts against the loss."""
    parameters = PpoParameters(value_weight=0.5, entropy_weight=0.1)
    zero = torch.zeros(1)
    got = loss(torch.ones(1), zero, torch.tensor([3.0]), torch.tensor([1.0]), torch.tensor([2.0]), parameters)
    assert got.item() == pytest.approx(0.5 * 0.5 * 4 - 0.1 * 2)


@pytest.mark.parametrize(("divergence", "factor"), [(0.05, 1 / 1.5), (0.001, 1.5), (0.01, 1.0)])
def test_learning_rate_follows_the_divergence(divergence: float, factor: float) -> None:
    """Too large a step slows learning down, too small a one speeds it up."""
    optimiser = torch.optim.Adam([torch.zeros(1, requires_grad=True)], 1e-3)
    adapt_learning_rate(optimiser, divergence, target=0.01)
    assert optimiser.param_groups[0]["lr"] == pytest.approx(1e-3 * factor)


def test_rewards_add_up_to_the_rise_of_value() -> None:
    """Playing the recorded actions again leads to a state whose value has risen by the rewards."""
    torch.manual_seed(0)
    network, parameters = ActorCritic(), PpoParameters()
    board = Curriculum(tasks=(4, 4), games=6).draw(np.random.default_rng(0))
    played = collect(network, board, 5, parameters, torch.Generator().manual_seed(0))
    state = begin(board)
    for action in played.action:
        state = step(board, state, action)
    rise = value_of(board, state) - value_of(board, begin(board))
    torch.testing.assert_close(played.reward.sum(0) / parameters.reward_scale, rise)


def test_ppo_learns_a_small_game() -> None:
    """A few dozen updates earn far more than the untrained network does on games of 4 tasks."""
    torch.manual_seed(0)
    rng, generator = np.random.default_rng(0), torch.Generator().manual_seed(0)
    member, parameters = new_member(ActorCritic(), 1e-3), PpoParameters()
    curriculum = Curriculum(tasks=(4, 4), agents_per_task=(4.0, 4.0), games=12, paper_share=1.0)
    earned = []
    for _ in range(25):
        board = curriculum.draw(rng)
        played = collect(member.network, board, curriculum.steps(board), parameters, generator)
        update(member.network, member.optimiser, board, played, parameters, generator)
        earned.append(played.reward.sum(0).mean().item())
    assert np.mean(earned[-5:]) > np.mean(earned[:3]) + 10
