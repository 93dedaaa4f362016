"""Common parts of the game environments: sampling of instances, and figures of an episode."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from alloc.problems.allocation import Allocation
from alloc.problems.bounds import makespan_lower_bound
from alloc.problems.errors import InputError
from alloc.problems.evaluation import evaluate
from alloc.problems.game import Board, State, battery_left, current_tasks, make_board
from alloc.problems.instance import Instance
from alloc.problems.vocabulary import IDLE

Source = Sequence[Instance] | Callable[[np.random.Generator], Instance]
"""Instances to sample from, or a function that makes one with a generator; all of the same size."""

Info = dict[str, float | int | bool]


@dataclass(frozen=True, eq=False)
class Game:
    """One game on one instance."""

    instance: Instance
    board: Board


def sizes_of(source: Source) -> tuple[int, int]:
    """Return the numbers of agents and tasks; if `source` is a function, those of its first instance.

    Raises
    ------
    InputError
        If there are no instances, or they differ in size.
    """
    instances = [source(np.random.default_rng(0))] if callable(source) else source
    found = {(instance.n, instance.m) for instance in instances}
    if len(found) != 1:
        raise InputError(f"an environment needs instances of equal size, got {sorted(found) or 'none'}", "instances")
    return found.pop()


def draw(source: Source, sizes: tuple[int, int], energy_weight: float, rng: np.random.Generator) -> Game:
    """Return a game on a random instance, with needs at the lower bound on its makespan.

    Raises
    ------
    InputError
        If the instance does not have the expected size.
    """
    instance = source(rng) if callable(source) else source[int(rng.integers(len(source)))]
    if not instance.reach.is_plain:
        raise InputError(
            f"{instance.name!r} must have Euclidean distances and one energy per distance, without returns"
        )
    if (instance.n, instance.m) != sizes:
        raise InputError(
            f"has {instance.n} agents and {instance.m} tasks, not {sizes[0]} and {sizes[1]}", instance.name
        )
    return Game(instance, make_board([instance], [makespan_lower_bound(instance)], [energy_weight], rng))


def episode_figures(game: Game, state: State) -> Info:
    """Return the energy of all hops so far, and the mean battery left in percent (figure 6 of the paper)."""
    distance = float(state.flown.double().sum()) / game.board.scale.item()
    energy = min(distance * game.instance.energy_per_distance, np.finfo(float).max)
    return {"episode_energy": energy, "episode_battery": 100 * battery_left(game.board, state).item()}


def plan_figures(game: Game, state: State) -> Info:
    """Return the scores of the current allocation as a plan, flown directly, by `evaluate`."""
    task = current_tasks(game.board, state)[0].numpy()
    scores = evaluate(game.instance, Allocation(np.where(task == game.instance.m, IDLE, task)))
    return {
        "makespan": scores.served_makespan,
        "unserved": len(scores.unserved_tasks),
        "energy": scores.energy,
        "reward": scores.reward,
    }
