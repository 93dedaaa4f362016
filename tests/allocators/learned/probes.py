"""Probe games: so small that the optimum is known, each requiring one ability that a method must be able to learn."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
import torch
from torch import Tensor

from alloc.allocators.learned.algorithms.learner import Learner, TrainingJob
from alloc.allocators.learned.play.action_sampling import choose
from alloc.problems import Instance
from alloc.problems.game import PLANNING, Board, Rules, begin, group_ability, make_board, step, worth

GAMES = 64


@dataclass(frozen=True)
class Probe:
    """A source of games from one fixed board."""

    board: Board

    def draw(self, rng: np.random.Generator, progress: float = 1.0) -> Board:
        return self.board[torch.from_numpy(rng.integers(0, GAMES, 16))]

    def max_steps(self, board: Board) -> int:
        return 6


def right_task(rng: np.random.Generator) -> tuple[Instance, float]:
    """One agent can do one of two tasks in time, and begins at the other."""
    small = int(rng.integers(2))
    workload = [1.0, 1.0]
    workload[1 - small] = float(rng.uniform(3, 5))
    return Instance(ability=[1], workload=workload, start_task=[1 - small]), 0.5


def pairing(rng: np.random.Generator) -> tuple[Instance, float]:
    """Two agents and two tasks, each made for one of them; both agents begin at the same task."""
    strong = float(rng.uniform(2, 4))
    abilities = rng.permutation([1.0, strong])
    workload = rng.permutation([1.0, strong])
    return Instance(ability=abilities, workload=workload, start_task=[int(rng.integers(2))] * 2), 0.5


def when_to_stop(rng: np.random.Generator) -> tuple[Instance, float]:
    """The initial allocation is optimal in half of the games; in the others one of three agents must move."""
    start = [0, 0, 1] if rng.random() < 0.5 else [0, 1, 1]
    place = rng.random((2, 2))
    return Instance(ability=[1, 1, 1], workload=[2, 1], task_position=place, start_task=start), 0.5


def energy_weight(rng: np.random.Generator) -> tuple[Instance, float]:
    """Moving an agent pays off at a low weight of energy, and does not at a high one."""
    place = np.array([[0.0, 0.0], rng.uniform(0.5, 1.0, 2)])
    instance = Instance(ability=[1, 1], workload=[1, 1], task_position=place, start_task=[0, 0])
    return instance, float(rng.choice([0.0, 15.0]))


PROBES: dict[str, Callable[[np.random.Generator], tuple[Instance, float]]] = {
    one.__name__: one for one in (right_task, pairing, when_to_stop, energy_weight)
}


def probe(name: str) -> Probe:
    """Return the probe of this name."""
    rng = np.random.default_rng(0)
    instances, weights = zip(*(PROBES[name](rng) for _ in range(GAMES)), strict=True)
    return Probe(make_board(instances, [1.0] * GAMES, weights, rng))


def best_utility(board: Board) -> Tensor:
    """Return the maximum utility over all allocations in each game, by enumeration, shape (B,)."""
    batch, n, c = board.shape
    start = begin(board)
    found = torch.full((batch,), -torch.inf)
    for slots in product(range(c), repeat=n):
        slot = torch.tensor(slots).expand(batch, n)
        allowed = board.legal.gather(2, slot[..., None]).flatten(1).all(1)
        moved = vars(start) | {"slot": slot, "group": group_ability(board, slot)}
        value = worth(board, type(start)(**moved))
        found = torch.where(allowed, torch.maximum(found, value), found)
    return found


@torch.no_grad()
def share_solved(learner: Learner, board: Board, rules: Rules = PLANNING) -> float:
    """Return the share of the games in which the best bids end at the best allocation."""
    state = begin(board)
    for _ in range(6):
        _, slot = choose(board, state, learner.policy(board, state), rules)
        state = step(board, state, slot)
    return float((worth(board, state, rules) > best_utility(board) - 1e-4).float().mean())


def share_learned(learner: Learner, name: str, jobs: int = 40, decisions: int = 150) -> float:
    """Return the share of the games of a probe that a learner solves after these jobs, or sooner once it is 1."""
    games, share = probe(name), 0.0
    for number in range(jobs):
        learner.train_on(TrainingJob(number, decisions, games, number / jobs))
        share = share_solved(learner, games.board) if number % 4 == 3 else 0.0
        if share == 1.0:
            break
    return share
