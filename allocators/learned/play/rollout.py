"""Batched games by torch; after each step, only the pairs affected by its moves are scored again."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic, Scores
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.problems.game import (
    PLANNING,
    Board,
    Rules,
    State,
    current_tasks,
    mean_distance,
    observe_pairs,
    relative_makespan,
    reset,
    step,
)
from alloc.problems.game.board import SMALLEST
from alloc.problems.game.observation import AgentAtPlace, pair_features, shortfalls

SCORE_CHUNK = 250_000
"""Maximum number of pairs scored at once, to limit memory."""

RESCORE_ALL = 0.5
"""Share of affected pairs above which all pairs are scored again, as gathering them would cost more than it saves."""

TIE = 1e-5
"""Relative difference below which two figures in single precision count as equal."""


@dataclass(frozen=True, eq=False)
class Best:
    """The best position of each game: by fewer unserved tasks, then less shortfall, then less distance.

    Attributes
    ----------
    slot : Tensor of int, shape (B, n)
    unserved : Tensor, shape (B,)
    shortfall : Tensor, shape (B,)
        Shortfall of the worst task if games are compared by makespan, or total shortfall.
    distance : Tensor, shape (B,)
    """

    slot: Tensor
    unserved: Tensor
    shortfall: Tensor
    distance: Tensor

    def better_than(self, other: "Best") -> Tensor:
        """Return whether each position is better than the other one, shape (B,)."""
        same = (self.shortfall - other.shortfall).abs() <= TIE
        less = (self.shortfall < other.shortfall) & ~same
        nearer = self.distance < other.distance * (1 - TIE)
        return (self.unserved < other.unserved) | ((self.unserved == other.unserved) & (less | (same & nearer)))

    def improved_by(self, other: "Best", rows: Tensor) -> "Best":
        """Replace the positions in `rows` by those of `other` where these are better."""
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
    """Return the position of each game; see `Best`."""
    need, group = board.need[:, :-1], state.group[:, :-1]
    time, unserved = relative_makespan(board, state.group)
    if total:
        shortfall = (need - group).clamp(min=0).sum(1) / need.sum(1).clamp(min=SMALLEST)
    else:
        shortfall = (1 - 1 / time.clamp(min=SMALLEST)).clamp(min=0)
    return Best(state.slot, unserved, shortfall, mean_distance(board, state))


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
    """Play the games on `board`, and return the best position of each.

    Parameters
    ----------
    network : ActorCritic
    board : Board
    steps : int
        Maximum number of steps.
    temperature : float
        Scores are divided by it before bids are drawn; 0 grants the best bids.
    generator : torch.Generator
        Generator of the draws.
    total : bool
        Whether positions are compared by the total shortfall instead of that of the worst task.
    should_stop : callable
        Called before each step, and between chunks of the first scoring.
    """
    state = reset(board)
    best = position(board, state, total)
    rows = torch.arange(len(board.energy_weight), device=board.energy_weight.device)
    scores = LocalScores(network, board, state, should_stop)
    for _ in range(steps):
        if should_stop() or bool(state.done.all()):
            break
        if 2 * int((~state.done).sum()) <= len(rows):
            going = torch.nonzero(~state.done)[:, 0]
            rows, board, state = rows[going], board[going], state[going]
            scores.keep(board, going)
        _, slot = sample_actions(board, state, scores.all(state), rules, temperature, generator)
        state = step_and_score(board, state, slot, scores)
        best = best.improved_by(position(board, state, total), rows)
    return best


def step_and_score(board: Board, state: State, slot: Tensor, scores: "LocalScores") -> State:
    """Make a step, and update the scores of the affected pairs."""
    after = step(board, state, slot)
    scores.refresh(state, after)
    return after


class LocalScores:
    """The local part of the scores of all pairs, kept up to date."""

    def __init__(self, network: ActorCritic, board: Board, state: State, should_stop: Callable[[], bool]) -> None:
        self.network, self.board = network, board
        self.local = board.energy_weight.new_full(board.shape, -1e9)
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
            some = slice(first, first + width)
            features = observe_pairs(self.board.of_agents(some), state.of_agents(some))
            self.local[:, some] = self.network.pairs(features)

    def all(self, state: State) -> Scores:
        """Return the scores of all bids."""
        token = self.network.places(self.board, state)
        return Scores(self.local + self.network.pointer(self.board, state, token), *self.network.heads(token))

    def keep(self, board: Board, rows: Tensor) -> None:
        """Drop all games but those in `rows`, which are on `board`."""
        self.board, self.local = board, self.local[rows]

    def refresh(self, before: State, after: State) -> None:
        """Score the pairs whose agent or candidate is at a place whose group changed."""
        board = self.board
        changed = before.group != after.group
        changed[:, -1] = False
        concerned = changed.gather(1, current_tasks(board, after)) | (before.slot != after.slot)
        touched = (
            concerned[..., None] | changed.gather(1, board.candidates.flatten(1)).view(board.shape)
        ) & board.legal
        game, agent, slot = torch.nonzero(touched, as_tuple=True)
        if len(game) > RESCORE_ALL * touched.numel():
            self._score_all(after)
        elif len(game):
            self.local[game, agent, slot] = self.network.pairs(_observe(board, after, game, agent, slot))


def _observe(board: Board, state: State, game: Tensor, agent: Tensor, slot: Tensor) -> Tensor:
    """Return `pair_features` of k pairs, given by number, shape (k, PAIR_FEATURES)."""
    shortfall, need = shortfalls(board, state), board.need.clamp(min=SMALLEST)

    def at_candidate(chosen: Tensor) -> AgentAtPlace:
        place = board.candidates[game, agent, chosen]
        contribution, distance = board.contribution[game, agent, chosen], board.distance[game, agent, chosen]
        return AgentAtPlace(
            shortfall[game, place], need[game, place], board.supply_ratio[game, place], contribution, distance
        )

    return pair_features(
        board.energy_weight[game],
        board.ability[game, agent],
        board.reachable_share[game, agent],
        own=at_candidate(state.slot[game, agent]),
        other=at_candidate(slot),
    )
