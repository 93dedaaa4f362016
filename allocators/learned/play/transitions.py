"""Rounds of bids as transitions of single moves, for methods that learn the value of a single move.

The bids of a round share no task and are granted one after another. A round is thus also a sequence of single moves in
the game in which one bid is granted at a time: each granted bid is a transition from the state after the previously
granted bids, and its reward is its marginal contribution. Off-policy methods (DQN, DDPG) thus learn from all bids of a
round, which costs one evaluation of the network.
"""

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic, Scores
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.play.stored_games import from_stored, stored_name, to_stored
from alloc.problems import InputError
from alloc.problems.game import (
    Board,
    Rules,
    State,
    TurnRule,
    action_mask,
    apply_moves,
    group_ability,
    marginal_contributions,
    reset,
    step,
)

FIRST = 1e6
"""Score that is higher than all others."""


class Transitions(NamedTuple):
    """N granted bids in games of one board, in a compact form.

    The next state is not stored: the game is deterministic, and `next_state` plays the bid again. Stopping is not
    stored either: it ends the game with value 0, which needs no learning.

    Attributes
    ----------
    board : Board
    game : Tensor of int16, shape (N,)
        Index of the game on the board.
    slot, location : Tensor of int16, shape (N, n)
        As in `State`, before the bid.
    flown : Tensor, shape (N, n)
    visited : Tensor of uint8, shape (N, ceil(n * c / 8))
        Bits of `State.visited`.
    action : Tensor of int32, shape (N,)
        ``agent * c + slot``.
    reward : Tensor, shape (N,)
    """

    board: Board
    game: Tensor
    slot: Tensor
    location: Tensor
    flown: Tensor
    visited: Tensor
    action: Tensor
    reward: Tensor

    def rows(self, index: Tensor) -> tuple[Board, State, Tensor, Tensor]:
        """Return board and state before each of these bids, the bid and its reward."""
        board, slot = self.board[self.game[index].long()], self.slot[index].long()
        _, n, c = board.shape
        left = np.unpackbits(self.visited[index].numpy(), axis=1, count=n * c).astype(bool)
        state = State(
            slot=slot,
            group=group_ability(board, slot),
            visited=torch.from_numpy(left).view(-1, n, c),
            done=torch.zeros(len(slot), dtype=torch.bool),
            location=self.location[index].long(),
            flown=self.flown[index],
        )
        return board, state, self.action[index].long(), self.reward[index]


class Played(NamedTuple):
    """Result of playing: transitions, decisions of agents, states that the network evaluated, and mean reward."""

    transitions: Transitions
    decisions: int
    evaluations: int
    reward: float


@torch.no_grad()
def play(
    network: ActorCritic,
    board: Board,
    steps: int,
    generator: torch.Generator,
    rules: Rules,
    temperature: float,
    exploring: float = 0.0,
    reward_scale: float = 1.0,
) -> Played:
    """Play up to `steps` rounds of every game on `board`, granting bids in the order of their perturbed scores.

    Parameters
    ----------
    temperature : float
        Temperature of the noise, see `sample_actions`.
    exploring : float
        Share of the rounds in which a uniformly random bid is granted before the others, also if the network would
        stop, as it would otherwise never learn what it misses.

    Raises
    ------
    InputError
        If all agents choose simultaneously, as the contribution of one agent then depends on all others.
    """
    if rules.turn == TurnRule.SIMULTANEOUS:
        raise InputError("dqn and ddpg learn the value of one move at a time: they play the turn rule `bidding` only")
    state = reset(board)
    columns: list[tuple[Tensor, ...]] = []
    decisions = evaluations = 0
    total = 0.0
    for _ in range(steps):
        if bool(state.done.all()):
            break
        scores = _exploring(network(board, state), board, state, rules, exploring, generator)
        actions, slot = sample_actions(board, state, scores, rules, temperature, generator)
        brought = reward_scale * marginal_contributions(board, state, actions, rules)
        evaluations += int((~state.done).sum())
        decisions += int((actions >= 0).sum())
        total += float(brought.sum())
        columns += _single_moves(board, state, actions, brought)
        state = step(board, state, slot)
    regions = [torch.cat(column) for column in zip(*columns, strict=True)] if columns else _nothing(board)
    return Played(Transitions(board, *regions), decisions, evaluations, total / len(state.done) / reward_scale)


def _exploring(
    scores: Scores, board: Board, state: State, rules: Rules, share: float, generator: torch.Generator
) -> Scores:
    """Put a random open bid first in a share of the games."""
    draw = torch.rand(scores.bids.shape, generator=generator).masked_fill(~action_mask(board, state, rules), -1.0)
    explores = torch.rand(len(draw), generator=generator) < share
    first = (
        torch.nn.functional.one_hot(draw.flatten(1).argmax(1), draw[0].numel()).view_as(draw) * explores[:, None, None]
    )
    return scores._replace(bids=scores.bids.masked_fill(first.bool(), FIRST))


def _single_moves(board: Board, state: State, actions: Tensor, brought: Tensor) -> list[tuple[Tensor, ...]]:
    """Split a round into single moves: return the fields of `Transitions` for each of its bids."""
    _, n, c = board.shape
    columns: list[tuple[Tensor, ...]] = []
    for action, reward in zip(actions.unbind(1), brought.unbind(1), strict=True):
        game = torch.nonzero((action >= 0) & (action < n * c))[:, 0]
        columns.append(
            (
                game.short(),
                state.slot[game].short(),
                state.location[game].short(),
                state.flown[game],
                torch.from_numpy(np.packbits(state.visited[game].flatten(1).numpy(), axis=1)),
                action[game].int(),
                reward[game],
            )
        )
        state = step(board, state, apply_moves(board, state, action[:, None]))
    return columns


def _nothing(board: Board) -> list[Tensor]:
    _, n, c = board.shape
    short, bits = torch.zeros(0, dtype=torch.int16), torch.zeros(0, (n * c + 7) // 8, dtype=torch.uint8)
    agents = torch.zeros(0, n, dtype=torch.int16)
    return [short, agents, agents, torch.zeros(0, n), bits, torch.zeros(0, dtype=torch.int32), torch.zeros(0)]


def next_state(board: Board, state: State, action: Tensor) -> State:
    """Return the states after one bid in each game, shape of `action` (B,)."""
    return step(board, state, apply_moves(board, state, action[:, None]))


def scores_above_reserve(bids: Tensor, reserve: Tensor, board: Board, state: State, rules: Rules) -> Tensor:
    """Return the scores of all bids, and of stopping in the last column, minus that of stopping; shape (B, n * c + 1).

    They are ``-inf`` if an agent may not bid; the last column is 0.
    """
    above = (bids - reserve[:, None, None]).masked_fill(~action_mask(board, state, rules), -torch.inf)
    return torch.cat([above.flatten(1), torch.zeros_like(reserve)[:, None]], 1)


class TransitionMemory:
    """The latest transitions, up to `capacity`; those of the oldest board are dropped first."""

    def __init__(self, capacity: int) -> None:
        self.capacity = capacity
        self.kept: list[Transitions] = []

    def __len__(self) -> int:
        """Number of transitions."""
        return sum(len(one.action) for one in self.kept)

    def add(self, new: Transitions) -> None:
        """Add the transitions of a board."""
        if len(new.action):
            self.kept.append(new)
        while len(self) > self.capacity:
            self.kept.pop(0)

    def draw(self, count: int, generator: torch.Generator) -> tuple[Board, State, Tensor, Tensor]:
        """Draw `count` transitions of one board, so that their arrays agree; each transition is equally likely."""
        sizes = torch.tensor([float(len(one.action)) for one in self.kept])
        chosen = self.kept[int(torch.multinomial(sizes, 1, generator=generator))]
        return chosen.rows(torch.randint(len(chosen.action), (count,), generator=generator))

    def state(self) -> list[dict[str, Any]]:
        """Return all transitions as dictionaries of tensors."""
        return [
            {**{stored_name(name): value for name, value in one._asdict().items()}, "board": to_stored(one.board)}
            for one in self.kept
        ]

    def load(self, state: list[dict[str, Any]]) -> None:
        """Restore what `state` returned."""
        self.kept = [
            Transitions(from_stored(Board, one["board"]), *(one[stored_name(name)] for name in Transitions._fields[1:]))
            for one in state
        ]
