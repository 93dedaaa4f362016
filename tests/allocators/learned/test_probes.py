"""The probe games, and that methods based on PPO solve them; the others are tested with their algorithms."""

import pytest
import torch
from probes import PROBES, best_utility, probe, share_learned, share_solved

from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters, PpoParameters
from alloc.allocators.learned.algorithms.ppo import Ppo
from alloc.problems.game import State, group_ability, reset, utility

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
    return torch.where(board.energy_weight[:, None] > 1, torch.tensor([0, 0]), torch.tensor([0, 1]))


@pytest.mark.parametrize("name", PROBES)
def test_enumerated_optima_match_known_answers(name: str) -> None:
    """The optimum found by enumeration equals the one known by reasoning."""
    board = probe(name).board
    slot = known_answer(name)
    state = State(**{**vars(reset(board)), "slot": slot, "group": group_ability(board, slot)})
    torch.testing.assert_close(utility(board, state), best_utility(board))


@pytest.mark.parametrize("name", PROBES)
def test_untrained_network_does_not_solve_probes(name: str) -> None:
    """Neither an untrained network nor the initial allocation solves all games."""
    board = probe(name).board
    assert share_solved(Ppo(), board) < 1
    assert (utility(board, reset(board)) < best_utility(board) - 1e-3).any()


@pytest.mark.parametrize("method", PARAMETERS)
@pytest.mark.parametrize("name", [pytest.param(one, marks=[pytest.mark.slow] * (one == "pairing")) for one in PROBES])
def test_ppo_solves_probes(name: str, method: str) -> None:
    """All games with known answers are solved."""
    assert share_learned(Ppo(parameters=PARAMETERS[method]), name) == 1.0
