"""Playing many games at once on one instance, scoring anew after a move only what it touched."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from alloc.allocators.learned.network import BARRED, ActorCritic
from alloc.problems.game import (
    Board,
    State,
    begin,
    deficit,
    flown,
    group_ability,
    observe_pairs,
    observe_tasks,
    pair_features,
    value_of,
)

SCORE_CHUNK = 250_000
"""Pairs scored at once, to bound the memory."""

TIE = 1e-5
"""Relative difference below which two makespans in single precision are taken for equal."""

PROGRESS = 1e-6
"""Rise of the value that counts as one."""


@dataclass(frozen=True, eq=False)
class Best:
    """The best position that each game passed through.

    Attributes
    ----------
    task : Tensor of int, shape (B, n)
    unserved : Tensor, shape (B,)
    time : Tensor, shape (B,)
        Makespan of the served tasks over the reference makespan.
    distance : Tensor, shape (B,)
    """

    task: Tensor
    unserved: Tensor
    time: Tensor
    distance: Tensor

    def cpu(self) -> "Best":
        """Return the same positions in main memory."""
        return Best(self.task.cpu(), self.unserved.cpu(), self.time.cpu(), self.distance.cpu())

    def improved_by(self, other: "Best") -> "Best":
        """Return the better of two positions for each game: fewer unserved, then sooner, then nearer."""
        same = (other.time - self.time).abs() <= TIE * self.time
        sooner = (other.time < self.time) & ~same
        better = (other.unserved < self.unserved) | (
            (other.unserved == self.unserved) & (sooner | (same & (other.distance < self.distance)))
        )
        return Best(
            torch.where(better[:, None], other.task, self.task),
            torch.where(better, other.unserved, self.unserved),
            torch.where(better, other.time, self.time),
            torch.where(better, other.distance, self.distance),
        )


def repeat(board: Board, price: Tensor) -> Board:
    """Return as many copies of a board with one game as there are prices; the copies share their memory."""

    def copies(tensor: Tensor) -> Tensor:
        return tensor.expand(len(price), *tensor.shape[1:])

    return Board(
        copies(board.ability),
        copies(board.target),
        copies(board.distance),
        copies(board.legal),
        copies(board.start),
        price,
        copies(board.supply),
        copies(board.choice),
    )


@torch.no_grad()
def play(
    network: ActorCritic,
    board: Board,
    *,
    steps: int,
    patience: int | None = None,
    haste: float = 0.0,
    temperature: float = 0.0,
    generator: torch.Generator | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Best:
    """Play the games on `board` and return the best positions on the way.

    Parameters
    ----------
    network : ActorCritic
    board : Board
        Any games, such as copies of one; see `repeat`.
    steps : int
        Most steps.
    patience : int, optional
        Steps without a new highest value, potential less energy, after which a game ends.
    haste : float
        Share of the outstanding moves, the total deficit over the mean ability, that is granted at once, one at the
        least; bids granted together share no task and no agent.
    temperature : float
        0 grants the best bid; above 0 bids are drawn with their logits divided by it.
    generator : torch.Generator
        Source of the draws.
    should_stop : callable
        Asked before each step, and between chunks of the first scoring.
    """
    state = begin(board)
    best = _position(board, state)
    game = _Game(network, board, state, should_stop)
    highest, stale = value_of(board, state), torch.zeros_like(board.price)
    for _ in range(steps):
        if should_stop() or bool(state.done.all()):
            break
        logits = game.logits(state)
        if temperature > 0:
            noise = torch.empty_like(logits).exponential_(generator=generator).log_()
            logits = logits / temperature - noise
        state = game.move(state, logits, haste)
        best = best.improved_by(_position(board, state))
        if patience is not None:
            value = value_of(board, state)
            stale = (stale + 1).masked_fill(value > highest + PROGRESS, 0)
            highest = torch.maximum(highest, value)
            state = State(state.task, state.group, state.done | (stale >= patience))
    return best


class _Game:
    """Local scores of all pairs, kept up to date move by move; nobody returns to a task that it left.

    Without that rule, which training does not know, greedy games end in two agents going back and forth.
    """

    def __init__(self, network: ActorCritic, board: Board, state: State, should_stop: Callable[[], bool]) -> None:
        self.network, self.board = network, board
        self.target = board.target.clamp(min=1e-3)
        self.barred = board.price.new_zeros(board.shape).masked_fill_(~board.legal, BARRED)
        self.score = board.price.new_full(board.shape, BARRED)
        for agents in _chunks(board, SCORE_CHUNK):
            if should_stop():
                break
            part = replace(
                board,
                ability=board.ability[:, agents],
                distance=board.distance[:, agents],
                legal=board.legal[:, agents],
                choice=board.choice[:, agents],
            )
            there = State(state.task[:, agents], state.group, state.done)
            self.score[:, agents] = network.local(observe_pairs(part, there))[..., 0]

    def logits(self, state: State) -> Tensor:
        """Return the logits of all bids and of stopping, shape (B, n * (m + 1) + 1)."""
        token = self.network.tasks(observe_tasks(self.board, state))
        bid = self.network.pointer(token, state.task, self.board.ability)
        bid += self.score
        bid += self.barred
        bid.scatter_(2, state.task[..., None], BARRED)
        return torch.cat([bid.flatten(1), self.network.heads(token)[0][:, None]], 1)

    def move(self, state: State, logits: Tensor, haste: float = 0.0) -> State:
        """Grant bids in every game that is not done, and score anew what they touched."""
        _, n, places = self.board.shape
        choice = logits.argmax(1)
        done = state.done | (choice == n * places)
        moves = self._outstanding(state).mul(haste).long().clamp(min=1)
        if int(moves.max()) == 1:
            rows, agents, goals = _granted(choice, done, places)
        else:
            rows, agents, goals = _disjoint(logits, state, done, moves)
        task = state.task.clone()
        sources = task[rows, agents]
        task[rows, agents] = goals
        self.barred[rows, agents, sources] = BARRED
        after = State(task, group_ability(self.board, task), done)
        if len(rows):
            self._score(after, *self._touched(after, rows, agents, sources, goals))
        return after

    def _outstanding(self, state: State) -> Tensor:
        """Total deficit in units of the mean ability, shape (B,)."""
        return (self.board.target - state.group)[:, :-1].clamp(min=0).sum(1)

    def _touched(
        self, state: State, rows: Tensor, agents: Tensor, sources: Tensor, goals: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Game, agent and task of every pair that moves touched, each of shape (k,).

        These are all pairs with the tasks that changed, and all pairs of the agents there; those who are idle see no
        change in their own place.
        """
        _, n, places = self.board.shape
        changed = torch.zeros_like(self.board.target, dtype=torch.bool)
        changed[rows, sources] = True
        changed[rows, goals] = True
        changed[:, -1] = False
        concerned = changed.gather(1, state.task)
        concerned[rows, agents] = True
        game, agent = torch.nonzero(concerned, as_tuple=True)
        where, column = torch.nonzero(changed, as_tuple=True)
        everyone, everywhere = (torch.arange(count, device=rows.device) for count in (n, places))
        return (
            torch.cat([where.repeat_interleave(n), game.repeat_interleave(places)]),
            torch.cat([everyone.repeat(len(where)), agent.repeat_interleave(places)]),
            torch.cat([column.repeat_interleave(n), everywhere.repeat(len(game))]),
        )

    def _score(self, state: State, game: Tensor, agent: Tensor, task: Tensor) -> None:
        board, lack = self.board, deficit(self.board, state)
        own_task = state.task[game, agent]
        own, other = (
            (lack[game, place], self.target[game, place], board.supply[game, place], board.distance[game, agent, place])
            for place in (own_task, task)
        )
        seen = pair_features(board.price[game], board.ability[game, agent], board.choice[game, agent], own, other)
        self.score[game, agent, task] = self.network.local(seen)[..., 0]


def _chunks(board: Board, size: int) -> Iterator[slice]:
    batch, n, places = board.shape
    width = max(1, size // (batch * places))
    return (slice(first, first + width) for first in range(0, n, width))


def _granted(choice: Tensor, done: Tensor, places: int) -> tuple[Tensor, Tensor, Tensor]:
    rows = torch.nonzero(~done)[:, 0]
    return rows, choice[rows] // places, choice[rows] % places


def _disjoint(logits: Tensor, state: State, done: Tensor, moves: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """The best bids that share no task (but the place of the idle) and no agent, up to `moves`, shape (B,), a game."""
    places, stop = state.group.shape[1], logits.shape[1] - 1
    top = logits.topk(min(8 * int(moves.max()), stop), dim=1)
    granted: list[tuple[int, int, int]] = []
    for game, (values, actions) in enumerate(zip(top.values.tolist(), top.indices.tolist(), strict=True)):
        used: set[int] = set()
        moved: set[int] = set()
        left = 0 if bool(done[game]) else int(moves[game])
        for value, action in zip(values, actions, strict=True):
            if left == 0 or action == stop or value < BARRED / 2:
                break
            agent, goal = divmod(action, places)
            source = int(state.task[game, agent])
            if agent in moved or source in used or goal in used:
                continue
            left -= 1
            moved.add(agent)
            used |= {source, goal} - {places - 1}
            granted.append((game, agent, goal))
    rows, agents, goals = torch.tensor(granted, dtype=torch.long, device=logits.device).reshape(-1, 3).unbind(1)
    return rows, agents, goals


def _position(board: Board, state: State) -> Best:
    target, group = board.target[:, :-1], state.group[:, :-1]
    needed = target > 0
    empty = needed & (group <= 0)
    time = (target / group.clamp(min=1e-9)).masked_fill(~needed | empty, 0.0).amax(1)
    return Best(state.task, empty.sum(1), time, flown(board, state))
