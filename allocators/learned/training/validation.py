"""How good a policy is: greedy games on fixed instances that are never trained on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.training.curriculum import Aimed, Curriculum, aim
from alloc.allocators.learned.training.families import RECIPES, draw_instance
from alloc.problems import InputError, Instance
from alloc.problems.game import Board, Rules, make_board, mean_distance, relative_makespan, reset, step, utility
from alloc.problems.generate import paper_like

VALIDATION = "shortfall-1"
"""Name of what `cost` is; runs that were judged otherwise are not gone on with."""

VALIDATION_SEED = 2 * 10**9

PRICE = 1.0
"""Weight of energy in all validation games."""

DISTANCE_WEIGHT = 0.25
"""What a unit of distance per agent counts in `cost`: a sixth of the least energy as much as 0.5 % of the makespan."""

MOST_OWN = 24
"""Own instances that are validated on at the most."""


@dataclass(frozen=True)
class Validation:
    """How one network plays the validation games, at the best position of each.

    Attributes
    ----------
    cost : float
        What the best networks are chosen by, the lower the better: mean over the boards of 1 - T_ref / T, which a
        single bad game cannot dominate, and of the distance, weighed. A task left unserved counts 1.
    unserved : float
        Mean over the boards of the tasks left unserved in a game: their part of the cost.
    time, distance : float
        Mean T / T_ref, and mean distance per agent in the board's scale, on the first board: instances like the
        paper's scenario 1, or one's own.
    others_time : float
        Harmonic mean of T / T_ref on the other boards; T_ref is a bound there that cannot always be met.
    reward : float
        Rise of the worth in a game: the cumulative reward of (12).
    """

    cost: float
    unserved: float
    time: float
    distance: float
    others_time: float
    reward: float


def validation_boards(curriculum: Curriculum) -> list[Board]:
    """Return the games on which networks are compared, always the same: like the paper's, and of the families."""
    rng = np.random.default_rng(VALIDATION_SEED)
    seeds = iter(range(VALIDATION_SEED, VALIDATION_SEED + 1000))
    kinds = [[paper_like(100, 20, 400, next(seeds)) for _ in range(12)]]
    if curriculum.families != ("paper",):
        named = tuple(RECIPES) if "mixed" in curriculum.families else curriculum.families
        kinds.append([draw_instance(name, 60, 10, next(seeds), rng) for name in named for _ in range(2)])
    return [_board(aim(kind), rng) for kind in kinds]


def hold_out(instances: Sequence[Instance]) -> tuple[list[Instance], list[Instance]]:
    """Split instances into those to train on, and a fifth to validate on: drawn at random, but always the same.

    Those without any work are left out: whatever is done there costs nothing. Of fewer than five others, all are for
    both.

    Raises
    ------
    InputError
        If there is nothing to do in any.
    """
    busy = [instance for instance in instances if (instance.workload > 0).any()]
    if not busy:
        raise InputError("there is no work to do in any instance; nothing can be learned", "instances")
    count = min(MOST_OWN, len(busy) // 5)
    if not count:
        return busy, busy
    held = set(np.random.default_rng(VALIDATION_SEED).choice(len(busy), count, replace=False).tolist())
    return [one for i, one in enumerate(busy) if i not in held], [one for i, one in enumerate(busy) if i in held]


def own_games(instances: Sequence[Instance], curriculum: Curriculum) -> tuple[Curriculum, list[Board]]:
    """Return a curriculum of the instances to train on, and boards of those to validate on; see `hold_out`."""
    train, held = hold_out(instances)
    sizes: dict[tuple[int, int], list[Aimed]] = {}
    for one in aim(held[:MOST_OWN]):
        sizes.setdefault((one.instance.n, one.instance.m), []).append(one)
    rng = np.random.default_rng(VALIDATION_SEED)
    return replace(curriculum, own=tuple(aim(train))), [_board(alike, rng) for alike in sizes.values()]


def _board(aimed: Sequence[Aimed], rng: np.random.Generator) -> Board:
    return make_board([one.instance for one in aimed], [one.hours for one in aimed], [PRICE] * len(aimed), rng)


@torch.no_grad()
def validate(network: ActorCritic, boards: Sequence[Board], rules: Rules, curriculum: Curriculum) -> Validation:
    """Play `boards` greedily, and judge the best position of each game."""
    played = [_play(network, board, rules, 2 * curriculum.steps(board)) for board in boards]
    others = torch.cat([outcome.time for outcome in played[1:] or played])
    return Validation(
        cost=float(np.mean([outcome.cost.mean() for outcome in played])),
        unserved=float(np.mean([outcome.unserved.mean() for outcome in played])),
        time=float(played[0].time.mean()),
        distance=float(played[0].distance.mean()),
        others_time=float(1 / others.clamp(min=1).reciprocal().mean()),
        reward=float(np.mean([outcome.rise.mean() for outcome in played])),
    )


class _Outcome(NamedTuple):
    """Cost, tasks unserved, T / T_ref, distance and rise of the worth of each game, all of shape (B,)."""

    cost: Tensor
    unserved: Tensor
    time: Tensor
    distance: Tensor
    rise: Tensor


def _play(network: ActorCritic, board: Board, rules: Rules, steps: int) -> _Outcome:
    """Play a board, and return the figures of the best position of each game."""
    state = reset(board)
    start = utility(board, state, rules)
    best = _Outcome(torch.full_like(start, torch.inf), start, start, start, start)
    for _ in range(steps):
        _, slot = sample_actions(board, state, network(board, state), rules)
        state = step(board, state, slot)
        time, unserved = relative_makespan(board, state.group)
        distance = mean_distance(board, state, rules)
        cost = 1 - 1 / time.clamp(min=1) + unserved + DISTANCE_WEIGHT * distance
        now = _Outcome(cost, unserved.to(cost.dtype), time, distance, utility(board, state, rules) - start)
        better = cost < best.cost
        best = _Outcome(*(torch.where(better, one, other) for one, other in zip(now, best, strict=True)))
        if bool(state.done.all()):
            break
    return best
