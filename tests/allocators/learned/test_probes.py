"""The probe games themselves, and that the methods by PPO solve them; the others do so beside their own tests."""

import pytest
import torch
from probes import PROBES, best_utility, probe, share_learned, share_solved
from resuming import assert_resumes_elsewhere

from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters, PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.problems.game import State, begin, group_ability, worth

PARAMETERS = {"ppo": PpoParameters(), "gappo": GappoParameters()}


def known_answer(name: str) -> torch.Tensor:
    """Return the optimal place of each agent in each game of a probe, by reasoning, shape (B, n)."""
    board = probe(name).board
    if name == "right_task":
        return board.need[:, :-1].argmin(1, keepdim=True)
    if name == "pairing":
        return (board.ability[:, :, None] - board.need[:, None, :-1]).abs().argmin(2)
    if name == "when_to_stop":
        return torch.tensor([0, 0, 1]).expand_as(board.start)
    return torch.where(board.price[:, None] > 1, torch.tensor([0, 0]), torch.tensor([0, 1]))


@pytest.mark.parametrize("name", PROBES)
def test_answers_are_known(name: str) -> None:
    """The optimum found by enumeration is the one known by reasoning."""
    board = probe(name).board
    slot = known_answer(name)
    state = State(**{**vars(begin(board)), "slot": slot, "group": group_ability(board, slot)})
    torch.testing.assert_close(worth(board, state), best_utility(board))


@pytest.mark.parametrize("name", PROBES)
def test_playing_without_learning_is_not_enough(name: str) -> None:
    """An untrained network does not solve all games, nor does the initial allocation."""
    board = probe(name).board
    assert share_solved(Ppo(), board) < 1
    assert (worth(board, begin(board)) < best_utility(board) - 1e-3).any()


@pytest.mark.parametrize("method", PARAMETERS)
@pytest.mark.parametrize("name", PROBES)
def test_ppo_solves_probes(name: str, method: str) -> None:
    """Games with known answers are solved, all of them."""
    assert share_learned(Ppo(parameters=PARAMETERS[method]), name) == 1.0


@pytest.mark.parametrize("method", PARAMETERS)
def test_a_job_depends_on_state_and_job_only(method: str) -> None:
    """Stored with its replay buffer between jobs and restored in another learner, training continues bit for bit."""
    assert_resumes_elsewhere(lambda seed: Ppo(parameters=PARAMETERS[method], seed=seed))
