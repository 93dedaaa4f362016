"""Playing many games at once, scoring anew after a step only the pairs that its moves touched."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic, Scores
from alloc.allocators.learned.play.action_sampling import choose
from alloc.problems.game import (
    PLANNING,
    Board,
    Rules,
    State,
    begin,
    flown,
    observe_pairs,
    step,
    tasks_of,
    time_over_reference,
)
from alloc.problems.game.board import LEAST
from alloc.problems.game.observation import Sight, lacks, pair_features

SCORE_CHUNK = 250_000
"""Pairs scored at once, to bound the memory."""

ANEW = 0.5
"""Share of the pairs touched from which on all are scored anew: gathering them costs more than it saves."""

TIE = 1e-5
"""Relative difference below which two figures in single precision are taken for equal."""


@dataclass(frozen=True, eq=False)
class Best:
    """The best position that each game passed through: fewer unserved, then less shortfall, then nearer.

    Attributes
    ----------
    slot : Tensor of int, shape (B, n)
    unserved : Tensor, shape (B,)
    shortfall : Tensor, shape (B,)
        Of the worst task where games are compared by makespan, of all together where by the total.
    distance : Tensor, shape (B,)
    """

    slot: Tensor
    unserved: Tensor
    shortfall: Tensor
    distance: Tensor

    def better_than(self, other: "Best") -> Tensor:
        """Whether each position is better than the other one, shape (B,)."""
        same = (self.shortfall - other.shortfall).abs() <= TIE
        less = (self.shortfall < other.shortfall) & ~same
        nearer = self.distance < other.distance * (1 - TIE)
        return (self.unserved < other.unserved) | ((self.unserved == other.unserved) & (less | (same & nearer)))

    def improved_by(self, other: "Best", rows: Tensor) -> "Best":
        """Put the positions of `other` in place of those in `rows` where they are better."""
        here = Best(self.slot[rows], self.unserved[rows], self.shortfall[rows], self.distance[rows])
        better = other.better_than(here)
        rows = rows[better]
        columns = []
        for name in ("slot", "unserved", "shortfall", "distance"):
            column = getattr(self, name).clone()
            column[rows] = getattr(other, name)[better]
            columns.append(column)
        return Best(*columns)


def position(board: Board, state: State, total: bool = False) -> Best:
    """Return where each game stands; see `Best`."""
    need, group = board.need[:, :-1], state.group[:, :-1]
    time, unserved = time_over_reference(board, state.group)
    if total:
        shortfall = (need - group).clamp(min=0).sum(1) / need.sum(1).clamp(min=LEAST)
    else:
        shortfall = (1 - 1 / time.clamp(min=LEAST)).clamp(min=0)
    return Best(state.slot, unserved, shortfall, flown(board, state))


@torch.no_grad()
def play(
    network: ActorCritic,
    board: Board,
    *,
    steps: int,
    rules: Rules = PLANNING,
    temperature: float = 0.0,
    generator: torch.Generator | None = None,
    total: bool = False,
    should_stop: Callable[[], bool] = lambda: False,
) -> Best:
    """Play the games on `board` and return the best positions on the way.

    Parameters
    ----------
    network : ActorCritic
    board : Board
        Any games, such as copies of one; see `Board.repeat`.
    steps : int
        Most steps.
    temperature : float
        0 grants the best bids; above 0 they are drawn with their scores divided by it.
    generator : torch.Generator
        Source of the draws.
    total : bool
        Whether positions are compared by the shortfall in total, instead of that of the worst task.
    should_stop : callable
        Asked before each step, and between chunks of the first scoring.
    """
    state = begin(board)
    best = position(board, state, total)
    rows = torch.arange(len(board.price), device=board.price.device)
    scores = _Local(network, board, state, should_stop)
    for _ in range(steps):
        if should_stop() or bool(state.done.all()):
            break
        if 2 * int((~state.done).sum()) <= len(rows):
            going = torch.nonzero(~state.done)[:, 0]
            rows, board, state = rows[going], board[going], state[going]
            scores.keep(board, going)
        _, slot = choose(board, state, scores.all(state), rules, temperature, generator)
        state = step_and_score(board, state, slot, scores)
        best = best.improved_by(position(board, state, total), rows)
    return best


def step_and_score(board: Board, state: State, slot: Tensor, scores: "_Local") -> State:
    """Make a step, and score anew what it touched."""
    after = step(board, state, slot)
    scores.refresh(state, after)
    return after


class _Local:
    """Local scores of all pairs, kept up to date."""

    def __init__(self, network: ActorCritic, board: Board, state: State, should_stop: Callable[[], bool]) -> None:
        self.network, self.board = network, board
        self.local = board.price.new_full(board.shape, -1e9)
        self._score_all(state, should_stop)

    def _score_all(self, state: State, should_stop: Callable[[], bool] = lambda: False) -> None:
        batch, n, c = self.board.shape
        width = max(1, SCORE_CHUNK // (batch * c))
        if width >= n:
            self.local = self.network.pairs(observe_pairs(self.board, state))
            return
        for first in range(0, n, width):
            if should_stop():
                break
            part, there = _agents(self.board, state, slice(first, first + width))
            self.local[:, first : first + width] = self.network.pairs(observe_pairs(part, there))

    def all(self, state: State) -> Scores:
        """Return the scores of all bids."""
        token = self.network.places(self.board, state)
        return Scores(self.local + self.network.pointer(self.board, state, token), *self.network.heads(token))

    def keep(self, board: Board, rows: Tensor) -> None:
        """Drop the other games."""
        self.board, self.local = board, self.local[rows]

    def refresh(self, before: State, after: State) -> None:
        """Score the pairs whose agent or goal is at a place that changed."""
        board = self.board
        changed = before.group != after.group
        changed[:, -1] = False
        concerned = changed.gather(1, tasks_of(board, after)) | (before.slot != after.slot)
        touched = (concerned[..., None] | changed.gather(1, board.goal.flatten(1)).view(board.shape)) & board.legal
        game, agent, slot = torch.nonzero(touched, as_tuple=True)
        if len(game) > ANEW * touched.numel():
            self._score_all(after)
        elif len(game):
            self.local[game, agent, slot] = self.network.pairs(_observe(board, after, game, agent, slot))


def _observe(board: Board, state: State, game: Tensor, agent: Tensor, slot: Tensor) -> Tensor:
    """Return `pair_features` of some pairs, shape (k, PAIR_FEATURES)."""
    lack, need = lacks(board, state), board.need.clamp(min=LEAST)

    def sight(chosen: Tensor) -> Sight:
        place = board.goal[game, agent, chosen]
        given, distance = board.contribution[game, agent, chosen], board.distance[game, agent, chosen]
        return lack[game, place], need[game, place], board.supply[game, place], given, distance

    own, other = sight(state.slot[game, agent]), sight(slot)
    return pair_features(board.price[game], board.ability[game, agent], board.choice[game, agent], own, other)


def _agents(board: Board, state: State, some: slice) -> tuple[Board, State]:
    """Return the same games with some of the agents, for their features alone."""
    per_agent = ("ability", "goal", "legal", "distance", "contribution", "start", "choice", "endurance")
    part = replace(board, **{name: getattr(board, name)[:, some] for name in per_agent})
    return part, replace(state, slot=state.slot[:, some], at=state.at[:, some], hopped=state.hopped[:, some])
