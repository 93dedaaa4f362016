"""DQN: targets match hand calculation, the target network is updated, and probe games are solved."""

import pytest
import torch
from probes import PROBES, probe, share_learned
from resuming import assert_resumes_elsewhere
from torch import Tensor

from alloc.allocators.learned.algorithms.dqn import Dqn, best_move_value, td_target
from alloc.allocators.learned.algorithms.hyperparameters import DqnParameters
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.play.transitions import next_state
from alloc.problems.game import PLANNING, State, action_mask, reset


def test_target_matches_hand_calculation() -> None:
    """r + gamma max Q, without the second term at the end of a game."""
    reward, following, over = torch.tensor([1.0, 1.0]), torch.tensor([4.0, 4.0]), torch.tensor([False, True])
    assert td_target(reward, following, over, 0.5).tolist() == [3.0, 1.0]


def test_double_estimate_matches_hand_calculation() -> None:
    """One network selects the move, the other values it."""
    value, picker = torch.tensor([[1.0, 5.0, 0.0]]), torch.tensor([[3.0, 2.0, 0.0]])
    assert best_move_value(value, value).tolist() == [5.0]
    assert best_move_value(value, picker).tolist() == [1.0]


def without_heads(learner: Dqn, bid: float, reserve: float) -> None:
    """Make the target network score every bid and the reserve the same everywhere."""
    for parameter in learner.target.parameters():
        torch.nn.init.zeros_(parameter)
    torch.nn.init.constant_(learner.target.local[-1].bias, bid)
    torch.nn.init.constant_(learner.target.reserve[-1].bias, reserve)


@pytest.mark.parametrize(
    ("bid", "reserve", "following"),
    [(7.0, 3.0, 4.0), (2.0, 3.0, 0.0)],
)
def test_targets_match_the_definition(bid: float, reserve: float, following: float) -> None:
    """Stopping has value 0 if all bids are below the reserve, and is the only action without open bids."""
    learner = Dqn(parameters=DqnParameters(gamma=0.5, double_q=False))
    without_heads(learner, bid, reserve)
    board = probe("right_task").board[torch.arange(2)]
    state = reset(board)
    none = State(**{**vars(state), "visited": torch.ones_like(state.visited)})
    reward = torch.tensor([1.0, 2.0])
    assert learner.td_targets(board, state, reward, PLANNING).tolist() == [1 + 0.5 * following, 2 + 0.5 * following]
    assert learner.td_targets(board, none, reward, PLANNING).tolist() == [1.0, 2.0]


def test_truncated_game_is_bootstrapped() -> None:
    """The last move of a game truncated by the step limit is followed by the value of the next state."""
    learner = Dqn(parameters=DqnParameters(gamma=0.5, double_q=False))
    without_heads(learner, 7.0, 3.0)
    board = probe("pairing").board[torch.arange(3)]
    first = action_mask(board, reset(board)).flatten(1).float().argmax(1)
    following = next_state(board, reset(board), first)
    assert not following.done.any()
    assert learner.td_targets(board, following, torch.zeros(3), PLANNING).tolist() == [2.0, 2.0, 2.0]


def flat(network: torch.nn.Module) -> Tensor:
    return torch.cat([one.detach().flatten() for one in network.parameters()])


def test_target_network_is_updated_periodically() -> None:
    """The target network is constant for the given number of updates, and then equals the online network."""
    learner = Dqn(parameters=DqnParameters(target_update_interval=3, replay_ratio=0.0))
    learner.train_on(TrainingJob(0, 50, curriculum=probe("pairing")))
    learner.updates = 0
    learner.target.load_state_dict(learner.network.state_dict())
    still, generator = flat(learner.target), torch.Generator().manual_seed(0)
    for number in (1, 2, 3, 4):
        learner.update(PLANNING, generator)
        assert torch.equal(flat(learner.target), still) == (number < 3)
        assert torch.equal(flat(learner.target), flat(learner.network)) == (number == 3)


def test_job_depends_only_on_state_and_job() -> None:
    """Stored with its replay buffer and restored in another learner, training continues bit for bit."""
    assert_resumes_elsewhere(Dqn)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBES)
def test_dqn_solves_probes(name: str) -> None:
    """All games with known answers are solved."""
    learner = Dqn(parameters=DqnParameters(learning_rate=3e-3, replay_ratio=8.0))
    assert share_learned(learner, name, decisions=60) == 1.0
