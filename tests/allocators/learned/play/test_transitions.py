"""Rounds split into single moves, and the buffer of these."""

import numpy as np
import pytest
import torch
from probes import probe

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.transitions import (
    TransitionMemory,
    Transitions,
    next_state,
    play,
    scores_above_reserve,
)
from alloc.problems import InputError, generate
from alloc.problems.game import PLANNING, Board, Rules, TurnRule, action_mask, make_board, reset, utility


@pytest.fixture
def board() -> Board:
    instances = [generate.paper_like(12, 5, 55, seed) for seed in range(3)]
    return make_board(instances, [1.0] * 3, [0.3, 1.0, 2.0], np.random.default_rng(0))


def played(board: Board, rules: Rules = PLANNING, steps: int = 3) -> Transitions:
    torch.manual_seed(0)
    return play(ActorCritic(), board, steps, torch.Generator().manual_seed(0), rules, 1.0, 1.0).transitions


@pytest.mark.parametrize("rules", [PLANNING, Rules(flying=True), Rules(returning=True), Rules(most_moves=2)])
def test_transitions_form_a_path_of_single_moves(board: Board, rules: Rules) -> None:
    """Each game's transitions are a path from its first state: state after state, one legal bid at a time, and each
    brings the rise of the utility."""
    path = played(board, rules)
    games, before, action, reward = path.rows(torch.arange(len(path.action)))
    assert action_mask(games, before, rules).flatten(1)[torch.arange(len(action)), action].all()
    following = next_state(games, before, action)
    torch.testing.assert_close(
        reward, utility(games, following, rules) - utility(games, before, rules), atol=1e-5, rtol=0
    )
    for game in range(3):
        rows = torch.nonzero(path.game == game)[:, 0]
        assert len(rows) > 4
        start = reset(board)[torch.tensor([game])]
        for field in ("slot", "visited", "location", "flown", "group"):
            states = torch.cat([getattr(start, field), getattr(following, field)[rows]])
            torch.testing.assert_close(states[:-1], getattr(before, field)[rows])


def test_simultaneous_choices_are_refused(board: Board) -> None:
    """The contribution of one agent is undefined with simultaneous choices, and the error says so."""
    with pytest.raises(InputError, match="bidding"):
        played(board, Rules(turn=TurnRule.SIMULTANEOUS))


def test_exploration_never_stops_at_once(board: Board) -> None:
    """A network that would stop at once still explores."""
    network = ActorCritic()
    with torch.no_grad():
        network.reserve[-1].bias += 100.0
    generator = torch.Generator().manual_seed(0)
    assert len(play(network, board, 5, generator, PLANNING, 0.1).transitions.action) == 0
    assert len(play(network, board, 1, generator, PLANNING, 0.1, exploring=1.0).transitions.action) == 3


def test_gains_are_scores_minus_the_reserve(board: Board) -> None:
    """Closed bids have no gain, and stopping has gain 0."""
    state = reset(board)
    bids, reserve = torch.full(board.shape, 3.0), torch.tensor([1.0, 2.0, 5.0])
    got = scores_above_reserve(bids, reserve, board, state, PLANNING)
    assert got[:, -1].tolist() == [0, 0, 0]
    opened = action_mask(board, state).flatten(1)
    assert torch.equal(got[:, :-1] > -torch.inf, opened)
    assert [set(row[open_].tolist()) for row, open_ in zip(got[:, :-1], opened, strict=True)] == [{2.0}, {1.0}, {-2.0}]


def test_oldest_board_is_dropped_first(board: Board) -> None:
    """The capacity is never exceeded, and the latest board is kept."""
    first, second = played(board, steps=1), played(board, steps=2)
    memory = TransitionMemory(len(first.action) + len(second.action) - 1)
    memory.add(first)
    memory.add(second)
    assert memory.kept == [second]


def test_transitions_are_drawn_uniformly(board: Board) -> None:
    """Each transition is equally likely, whatever the sizes of the boards."""
    small = played(board, steps=1)
    large = played(probe("pairing").board, steps=1)
    memory, generator = TransitionMemory(10_000), torch.Generator().manual_seed(0)
    memory.add(small)
    memory.add(large)
    share = sum(memory.draw(1, generator)[0].shape[1] == 12 for _ in range(2000)) / 2000
    assert share == pytest.approx(len(small.action) / len(memory), abs=0.05)
