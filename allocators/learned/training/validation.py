"""Validation of policies by greedy games on fixed instances that are never used for training."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from alloc.allocators.learned.network.actor_critic import ActorCritic
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.training.curriculum import Curriculum, TrainingInstance, with_reference
from alloc.allocators.learned.training.families import RECIPES, draw_instance
from alloc.problems import InputError, Instance
from alloc.problems.game import Board, Rules, make_board, mean_distance, relative_makespan, reset, step, utility
from alloc.problems.generate import paper_like

VALIDATION = "shortfall-1"
"""Identifier of the definition of `cost`; runs with another definition cannot be resumed."""

VALIDATION_SEED = 2 * 10**9

ENERGY_WEIGHT = 1.0
"""Weight of energy in all validation games."""

DISTANCE_WEIGHT = 0.25
"""Weight of the distance per agent in `cost`: a sixth of the minimum energy weighs as much as 0.5 % of the makespan."""

MAX_HELD_OUT = 24
"""Maximum number of given instances for validation."""

MAX_NAMES = 10
"""Maximum number of instances named in a note."""


@dataclass(frozen=True)
class Validation:
    """Performance of one network in the validation games, at the best position of each.

    Attributes
    ----------
    cost : float
        Selection criterion for the best networks, to be minimised: mean over the boards of 1 - T_ref / T, which no
        single bad game can dominate, plus the weighted distance, plus 1 for each unserved task.
    unserved : float
        Mean over the boards of the unserved tasks in a game, which are part of the cost.
    time, distance : float
        Mean T / T_ref, and mean distance per agent in the board's scale, on the first board, which has instances like
        those of the paper's scenario 1, or given ones.
    others_time : float
        Harmonic mean of T / T_ref on the other boards, where the bound T_ref cannot always be attained.
    reward : float
        Increase of the utility in a game, which is the cumulative reward of (12).
    """

    cost: float
    unserved: float
    time: float
    distance: float
    others_time: float
    reward: float


def validation_boards(curriculum: Curriculum) -> list[Board]:
    """Return the fixed games for comparing networks: on instances like those of the paper, and of the families."""
    rng = np.random.default_rng(VALIDATION_SEED)
    seeds = iter(range(VALIDATION_SEED, VALIDATION_SEED + 1000))
    kinds = [[paper_like(100, 20, 400, next(seeds)) for _ in range(12)]]
    if curriculum.families != ("paper",):
        named = tuple(RECIPES) if "mixed" in curriculum.families else curriculum.families
        kinds.append([draw_instance(name, 60, 10, next(seeds), rng) for name in named for _ in range(2)])
    return [_board(with_reference(kind), rng) for kind in kinds]


def hold_out(instances: Sequence[Instance]) -> tuple[list[Instance], list[Instance]]:
    """Split instances into a training set, and a validation set of a fifth of them, drawn with a fixed seed.

    Instances without work are left out, as every allocation of them costs nothing. If fewer than five are left, both
    sets contain all of them.

    Raises
    ------
    InputError
        If no instance has any work.
    """
    busy = [instance for instance in instances if (instance.workload > 0).any()]
    if not busy:
        raise InputError("there is no work to do in any instance; nothing can be learned", "instances")
    count = min(MAX_HELD_OUT, len(busy) // 5)
    if not count:
        return busy, busy
    held = set(np.random.default_rng(VALIDATION_SEED).choice(len(busy), count, replace=False).tolist())
    return [one for i, one in enumerate(busy) if i not in held], [one for i, one in enumerate(busy) if i in held]


def games_on(instances: Sequence[Instance], curriculum: Curriculum) -> tuple[Curriculum, list[Board]]:
    """Return `curriculum` with given instances, and boards of those for validation; see `hold_out`."""
    train, held = hold_out(instances)
    sizes: dict[tuple[int, int], list[TrainingInstance]] = {}
    for one in with_reference(held[:MAX_HELD_OUT]):
        sizes.setdefault((one.instance.n, one.instance.m), []).append(one)
    rng = np.random.default_rng(VALIDATION_SEED)
    return replace(curriculum, instances=tuple(with_reference(train))), [_board(alike, rng) for alike in sizes.values()]


def split_notes(instances: Sequence[Instance]) -> list[str]:
    """Return notes on the instances that are left out, and on those that are held out for validation."""
    train, held = hold_out(instances)
    notes = []
    idle = sum(not (instance.workload > 0).any() for instance in instances)
    if idle:
        notes.append(f"{idle} of {len(instances)} instances left out: there is no work to do")
    if train == held:
        reason = "with five or more, a fifth is held out"
        notes.append(f"the networks are judged on the instances that they learn from; {reason}")
    else:
        names = ", ".join(instance.name for instance in held[:MAX_NAMES])
        more = f" and {len(held) - MAX_NAMES} more" if len(held) > MAX_NAMES else ""
        notes.append(f"{len(held)} of {len(instances)} instances held out to judge the networks: {names}{more}")
    return notes


def _board(games: Sequence[TrainingInstance], rng: np.random.Generator) -> Board:
    targets = [one.reference_h for one in games]
    return make_board([one.instance for one in games], targets, [ENERGY_WEIGHT] * len(games), rng)


@torch.no_grad()
def validate(network: ActorCritic, boards: Sequence[Board], rules: Rules, curriculum: Curriculum) -> Validation:
    """Play `boards` greedily, and return the mean figures of the best position of each game."""
    played = [_play(network, board, rules, 2 * curriculum.max_steps(board)) for board in boards]
    others = torch.cat([outcome.time for outcome in played[1:] or played])
    return Validation(
        cost=float(np.mean([outcome.cost.mean() for outcome in played])),
        unserved=float(np.mean([outcome.unserved.mean() for outcome in played])),
        time=float(played[0].time.mean()),
        distance=float(played[0].distance.mean()),
        others_time=float(1 / others.clamp(min=1).reciprocal().mean()),
        reward=float(np.mean([outcome.reward.mean() for outcome in played])),
    )


class _Outcome(NamedTuple):
    """Cost, unserved tasks, T / T_ref, distance and increase of the utility of each game, all of shape (B,)."""

    cost: Tensor
    unserved: Tensor
    time: Tensor
    distance: Tensor
    reward: Tensor


def _play(network: ActorCritic, board: Board, rules: Rules, steps: int) -> _Outcome:
    """Play a board, and return the figures of each game's best position."""
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
