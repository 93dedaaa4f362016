"""Compiled games have the same scores, moves and best positions as games in torch."""

import numpy as np
import pytest
import torch
from boards import layout
from test_rollout import BOARDS

from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.network.game_arrays import game_arrays
from alloc.allocators.learned.network.weights import weights_of
from alloc.allocators.learned.play.batched_games import Games, play_games
from alloc.allocators.learned.play.rollout import play
from alloc.problems import paper_like
from alloc.problems.game import Board

pytestmark = pytest.mark.timeout(400)  # compiles at first


def games_on(board: Board, copies: int = 1) -> Games:
    row = np.arange(len(board.energy_weight)).repeat(copies)
    return Games(row, board.energy_weight.numpy().astype(float)[row], board.start.numpy()[row])


@pytest.mark.parametrize("attention", [True, False])
@pytest.mark.parametrize("total", [True, False])
@pytest.mark.parametrize("name", BOARDS)
def test_compiled_games_match_torch(name: str, total: bool, attention: bool) -> None:
    """Played greedily, every game ends in the same best position, within single precision."""
    board = BOARDS[name]()
    torch.manual_seed(3)
    network = ActorCritic(NetworkSize(attention=attention)).eval().requires_grad_(False)
    compiled = play_games(network, board, games_on(board), rounds=12, total=total)
    expected = play(network, board, steps=12, total=total)
    assert torch.equal(compiled.unserved.long(), expected.unserved.long())
    torch.testing.assert_close(compiled.shortfall.float(), expected.shortfall, atol=2e-5, rtol=1e-4)
    torch.testing.assert_close(compiled.distance.float(), expected.distance, atol=2e-5, rtol=1e-4)
    assert torch.equal(compiled.slot, expected.slot)


def test_sampled_games_are_legal_and_reproducible() -> None:
    """Sampled games respect reach, differ from each other, and are reproducible by seed."""
    board = BOARDS["ranged"]()
    torch.manual_seed(3)
    network = ActorCritic().eval().requires_grad_(False)
    first, again, other = (
        play_games(network, board, games_on(board, 5), rounds=6, temperature=1.0, seed=seed) for seed in (1, 1, 2)
    )
    assert torch.equal(first.slot, again.slot)
    assert not torch.equal(first.slot, other.slot)
    legal = board.legal[torch.from_numpy(games_on(board, 5).row)]
    assert legal.gather(2, first.slot[..., None]).all()


def test_stop_request_ends_play_with_a_position() -> None:
    """At a stop request the first game has a position, and games not yet started count as infinitely bad."""
    board = layout(*(paper_like(20, 4, 80, seed) for seed in range(3)))
    network = ActorCritic().eval().requires_grad_(False)
    best = play_games(network, board, games_on(board), rounds=5, should_stop=lambda: True)
    assert torch.isfinite(best.distance[0])
    assert torch.isinf(best.shortfall[1:]).all()


def test_weights_and_arrays_keep_their_values() -> None:
    """The last row of the weights is the bias, and game arrays share the numbers of the board."""
    network = ActorCritic()
    weights = weights_of(network)
    assert np.allclose(weights.local1[:-1].T, network.local[0].weight.detach().numpy())
    assert np.allclose(weights.local1[-1], network.local[0].bias.detach().numpy())
    board = BOARDS["dense"]()
    game = game_arrays(board)[2]
    assert np.array_equal(game.need, board.need[2].numpy())
    assert np.array_equal(game.candidates, board.candidates[2].numpy())
