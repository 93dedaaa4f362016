"""Rules of the game: states, legal moves, transitions, and distances flown."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import torch
from torch import Tensor

from alloc.problems.game.board import Board
from alloc.problems.vocabulary import Reward, TurnRule

TOLERANCE = 1e-5
"""Tolerance on the distance that a battery allows, for rounding errors in single precision."""


@dataclass(frozen=True)
class Rules:
    """Rules of a game.

    Attributes
    ----------
    turn : TurnRule or str
        ``bidding``: all agents bid for all their candidates, and bids are granted in descending order, except those
        that share a task with a bid already granted. ``simultaneous``, as in the paper: all agents choose at once.
    reward : Reward or str
        ``makespan``: see `potential`; ``coverage``: (3).
    flying : bool
        Whether agents fly in each step, so that energy accumulates over the hops (19) and the remaining battery limits
        the reach. If not, they fly only to their final place, and energy is that of the plan.
    returning : bool
        Whether an agent may return to a place that it left in the same episode.
    most_moves : int or None
        Maximum number of bids granted in a step; 1 for one move at a time.
    """

    turn: TurnRule | str = TurnRule.BIDDING
    reward: Reward | str = Reward.MAKESPAN
    flying: bool = False
    returning: bool = False
    most_moves: int | None = None


PLANNING = Rules()
"""The game of the built-in policies: agents bid, and fly after all decisions."""

PAPER = Rules(TurnRule.SIMULTANEOUS, Reward.COVERAGE, flying=True, returning=True)
"""The game of the paper, section 2.2."""


@dataclass(frozen=True, eq=False)
class State:
    """States of B games.

    Attributes
    ----------
    slot : Tensor of int, shape (B, n)
        Candidate that each agent has chosen.
    group : Tensor, shape (B, m + 1)
        Ability at each place.
    visited : Tensor of bool, shape (B, n, c)
        Candidates that each agent has left in this episode.
    done : Tensor of bool, shape (B,)
        Whether the game has ended.
    location : Tensor of int, shape (B, n)
        Task to which each agent has flown, initially its start, m if that is not a task; idle agents stay there.
    flown : Tensor, shape (B, n)
        Distance that each agent has flown, hop by hop.
    """

    slot: Tensor
    group: Tensor
    visited: Tensor
    done: Tensor
    location: Tensor
    flown: Tensor

    def __getitem__(self, rows: Tensor | tuple[Tensor, ...]) -> State:
        """Return the states with the given indices."""
        return State(*(getattr(self, field.name)[rows] for field in fields(self)))

    def of_agents(self, some: slice) -> State:
        """Return the states with a slice of the agents, to compute features for these only."""
        return replace(self, slot=self.slot[:, some], location=self.location[:, some], flown=self.flown[:, some])


def reset(board: Board) -> State:
    """Return the initial states, in which agents have flown to their initial slots."""
    return State(
        slot=board.start,
        group=group_ability(board, board.start),
        visited=torch.zeros_like(board.legal),
        done=torch.zeros_like(board.energy_weight, dtype=torch.bool),
        location=at_slot(board.candidates, board.start),
        flown=at_slot(board.distance, board.start),
    )


def at_slot(values: Tensor, slot: Tensor) -> Tensor:
    """Return each agent's value at its slot: shapes (B, n, c) and (B, n) give (B, n)."""
    return values.gather(2, slot[..., None])[..., 0]


def current_tasks(board: Board, state: State) -> Tensor:
    """Return the task of each agent, m for idle, shape (B, n)."""
    return at_slot(board.candidates, state.slot)


def group_ability(board: Board, slot: Tensor) -> Tensor:
    """Return the ability at each place, shape (B, m + 1)."""
    return sum_by_place(at_slot(board.contribution, slot)[..., None], at_slot(board.candidates, slot), board.places)[
        ..., 0
    ]


def sum_by_place(values: Tensor, place: Tensor, places: int) -> Tensor:
    """Sum values of agents by place: shapes (B, n, k) and (B, n) give (B, places, k).

    A matrix product is bitwise deterministic, unlike `scatter_add` on a GPU, which adds in arbitrary order.
    """
    if values.device.type == "cpu":
        empty = values.new_zeros(len(values), places, values.shape[2])
        return empty.scatter_add(1, place[..., None].expand_as(values), values)
    here = place[:, None] == torch.arange(places, device=place.device)[:, None]
    return here.to(values.dtype) @ values


def action_mask(board: Board, state: State, rules: Rules = PLANNING) -> Tensor:
    """Return which candidates each agent may move to, shape (B, n, c): legal, not its own, not visited."""
    allowed = board.legal & ~state.done[:, None, None]
    if not rules.returning:
        allowed = allowed & ~state.visited
    if rules.flying:
        allowed = allowed & (
            state.flown[..., None] + hop_distance(board, state) <= board.endurance[..., None] + TOLERANCE
        )
    return allowed.scatter(2, state.slot[..., None], False)


def hop_distance(board: Board, state: State) -> Tensor:
    """Return the distance from each agent's location to its candidates, shape (B, n, c); 0 for idle."""
    rows = board.task_distance.gather(1, state.location[..., None].expand(-1, -1, board.places)).gather(
        2, board.candidates
    )
    from_start = (state.location == board.places - 1)[..., None]
    return torch.where(from_start, board.distance, rows).masked_fill(board.candidates == board.places - 1, 0.0)


def grant_bids(board: Board, state: State, bids: Tensor, reserve: Tensor, most_moves: int | None = None) -> Tensor:
    """Grant bids above the reserve in descending order, except those that share a task with a granted one.

    Parameters
    ----------
    bids : Tensor, shape (B, n, c)
        Bids; ``-inf`` where an agent may not bid.
    reserve : Tensor, shape (B,)
        Reserve price, below which bids are not granted; a game without a granted bid ends.
    most_moves : int, optional
        Maximum number of granted bids.

    Returns
    -------
    Tensor of int, shape (B, k)
        The granted bids, ``agent * c + slot``, in order; then ``n * c`` once if the reserve came next or no other agent
        could bid; then -1. After `most_moves` granted bids, no reserve follows.
    """
    batch, n, c = board.shape
    task, idle = current_tasks(board, state), board.places - 1
    flat = torch.cat([bids.flatten(1), reserve[:, None]], 1)
    open_, passed = flat[:, :-1].view(batch, n, c), state.done.clone()
    granted: list[Tensor] = []
    flat[state.done, :-1] = -torch.inf
    rows = torch.arange(batch, device=flat.device)
    while not bool(passed.all()) and (most_moves is None or len(granted) < most_moves):
        best, bid = flat.max(1)
        bid = bid.masked_fill(best == -torch.inf, n * c)
        granted.append(bid.masked_fill(passed, -1))
        passed = passed | (bid == n * c)
        agent = torch.div(bid, c, rounding_mode="floor").clamp(max=n - 1)
        source = task[rows, agent]
        target = board.candidates[rows, agent, bid % c]
        source = source.masked_fill(passed | (source == idle), -1)[:, None]
        target = target.masked_fill(passed | (target == idle), -1)[:, None]
        open_.masked_fill_(((task == source) | (task == target))[..., None], -torch.inf)
        open_.masked_fill_(
            (board.candidates == source[..., None]) | (board.candidates == target[..., None]), -torch.inf
        )
        open_[rows, agent] = open_[rows, agent].masked_fill(~passed[:, None], -torch.inf)
    return torch.stack(granted, 1) if granted else task.new_full((batch, 1), -1)


def apply_moves(board: Board, state: State, granted: Tensor) -> Tensor:
    """Return the slots of all agents after the granted bids, shape (B, n).

    Parameters
    ----------
    granted : Tensor of int, shape (B, k)
        Bids, ``agent * c + slot``; other values are ignored.
    """
    batch, n, c = board.shape
    slot = torch.cat([state.slot, state.slot.new_zeros(batch, 1)], 1)  # the last column absorbs other values
    real = (granted >= 0) & (granted < n * c)
    agent = torch.where(real, torch.div(granted, c, rounding_mode="floor"), n)
    return slot.scatter(1, agent, granted.clamp(min=0) % c)[:, :-1]


def step(board: Board, state: State, slot: Tensor) -> State:
    """Move every agent to a candidate; a game in which no agent moves ends.

    Parameters
    ----------
    slot : Tensor of int, shape (B, n)
        Candidate to which each agent goes, or its current slot to stay; ignored in finished games.
    """
    slot = torch.where(state.done[:, None], state.slot, slot)
    goes = slot != state.slot
    here = torch.zeros_like(state.visited).scatter_(2, state.slot[..., None], True)
    place = at_slot(board.candidates, slot)
    flies = goes & (place != board.places - 1)
    return State(
        slot=slot,
        group=group_ability(board, slot),
        visited=state.visited | (goes[..., None] & here),
        done=state.done | ~goes.any(1),
        location=torch.where(flies, place, state.location),
        flown=state.flown + _flight(board, state, slot, place) * flies,
    )


def _flight(board: Board, state: State, slot: Tensor, place: Tensor) -> Tensor:
    """Return `hop_distance` to one candidate of each agent, shape (B, n)."""
    games = torch.arange(len(place), device=place.device)[:, None]
    return torch.where(
        state.location == board.places - 1,
        at_slot(board.distance, slot),
        board.task_distance[games, state.location, place],
    )


def mean_distance(board: Board, state: State, rules: Rules = PLANNING) -> Tensor:
    """Return the mean distance flown per agent, shape (B,): directly to the final place (19), or hop by hop."""
    return (state.flown if rules.flying else at_slot(board.distance, state.slot)).sum(1) / board.agent_count


def battery_left(board: Board, state: State) -> Tensor:
    """Return the share of the battery left after the hops of the episode, shape (B,).

    This is the mean over agents with a battery; 1 if no agent has one.
    """
    limited = board.endurance < torch.inf
    spent = (state.flown / board.endurance.clamp(min=TOLERANCE)).clamp(max=1.0) * limited
    return 1 - spent.sum(1) / limited.sum(1).clamp(min=1)
