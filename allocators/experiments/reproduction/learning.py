"""One training from nothing, judged on the way by greedy games on instances that nothing is trained on."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np
import torch

from alloc.allocators.experiments.reproduction.protocol import (
    DECISIONS,
    DRAWN,
    ENERGY_WEIGHT,
    INSTANCE_SEED,
    POINTS,
    TEST_GAMES,
    TEST_SEED,
    TESTS,
    TUNED,
    VARIANTS,
    Job,
    Variant,
    judged,
    scenarios_of,
)
from alloc.allocators.experiments.reproduction.rows import Learned
from alloc.allocators.learned.algorithms.genes import GeneticPpo
from alloc.allocators.learned.algorithms.hyperparameters import GappoParameters
from alloc.allocators.learned.algorithms.learner import Learner, TrainingJob
from alloc.allocators.learned.algorithms.registry import method_parameters, new_learner
from alloc.allocators.learned.algorithms.separate import SeparateMembers
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.play.rollout import position
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems import Instance, makespan_lower_bound
from alloc.problems.game import PLANNING, Board, apply_moves, battery_left, make_board, relative_makespan, reset, step
from alloc.problems.generate import paper

GAMES = Curriculum(
    families=("paper",),
    initial_tasks=(4, 8),
    tasks=(4, 10),
    max_agents=50,
    energy_weight=(ENERGY_WEIGHT, ENERGY_WEIGHT),
    max_pairs=1200,
    games=(4, 48),
    relaxed_fraction=0.0,
)
"""What is trained on: like the paper's scenarios, at most half as large as the first; few games per update, since
decisions are few."""

ROUNDS = 60
"""Most rounds of a game; nobody returns to a task, so that games end long before."""


@dataclass(frozen=True)
class _Judged:
    """Games by which a policy is judged, and the proven bound of each, the target of its board: hours, shape (B,)."""

    board: Board
    bound: torch.Tensor


@dataclass(frozen=True)
class _Played:
    """Figures of each game of a board, arrays of shape (B,); makespans are relative, infinite with a task unserved."""

    makespan: torch.Tensor
    unserved: torch.Tensor
    battery: torch.Tensor
    hops: torch.Tensor
    distance: torch.Tensor


def learn(job: Job) -> list[Learned]:
    """Train a method from nothing, and return its rows: at every point on the test games and the run's instances."""
    games = _judged_by(job.run)
    with plain_torch(), torch_threads(1):
        learner = _untrained(VARIANTS[job.method], job.run)
        rows = [_row(job, learner, scenario, own, 0, (0, 0, 0.0)) for scenario, own in games.items()]
        spent = (0, 0, 0.0)
        for point in (point for point in POINTS if point <= job.iterations):
            spent = _trained(learner, job, point, spent)
            wanted = (key for key in games if point in judged(key, job.iterations))
            rows += [_row(job, learner, key, games[key], point, spent) for key in wanted]
    return rows


def _untrained(variant: Variant, seed: int) -> Learner:
    parameters = method_parameters(variant.method, {**TUNED[variant.method], **variant.changes})
    size = NetworkSize(attention=variant.has_attention)
    if variant.shares_network:
        return new_learner(variant.method, size, parameters, seed)
    assert isinstance(parameters, GappoParameters)
    return SeparateMembers(size, parameters, seed)


def _trained(learner: Learner, job: Job, point: int, spent: tuple[int, int, float]) -> tuple[int, int, float]:
    """Train up to a point; return decisions, evaluations and seconds up to then."""
    decisions, evaluations, seconds = spent
    left = DECISIONS * point - decisions
    if left <= 0:
        return spent
    seed = int(np.random.SeedSequence((job.run, point)).generate_state(1, np.uint64)[0] >> np.uint64(1))
    began = time.process_time()
    stats = learner.train_on(TrainingJob(seed, left, GAMES, decisions / (DECISIONS * job.iterations)))
    seconds += time.process_time() - began
    return decisions + stats.decisions, evaluations + stats.evaluations, seconds


@cache
def _test_games() -> _Judged:
    return _judged([paper(1, TEST_SEED + number) for number in range(TEST_GAMES)])


def _judged_by(run: int) -> Mapping[int, _Judged]:
    """Return the test games, and a run's instances, by the numbers of their scenarios in the rows."""
    own = {scenario: _judged([paper(scenario, INSTANCE_SEED + run)]) for scenario in scenarios_of(run)}
    return {TESTS: _test_games(), **own}


def _judged(instances: list[Instance]) -> _Judged:
    bounds = [makespan_lower_bound(instance) for instance in instances]
    board = make_board(instances, bounds, [ENERGY_WEIGHT] * len(instances), np.random.default_rng(0))
    return _Judged(board, torch.tensor(bounds, dtype=torch.double))


def _row(
    job: Job, learner: Learner, scenario: int, games: _Judged, iteration: int, spent: tuple[int, int, float]
) -> Learned:
    played = _play(learner.policy, games.board)
    is_last = scenario == TESTS and iteration == job.iterations
    return Learned(
        method=job.method,
        run=job.run,
        iterations=job.iterations,
        iteration=iteration,
        scenario=scenario,
        decisions=spent[0],
        evaluations=spent[1],
        makespan=float((games.bound * played.makespan).median()),
        lower_bound=float(games.bound.median()),
        unserved=float(played.unserved.mean()),
        battery=100 * float(played.battery.mean()),
        hops=float(played.hops.mean()),
        distance=float(played.distance.mean()),
        drawn=_best_of_drawn(learner, games, job.run) if is_last else float("nan"),
        seconds=spent[2],
    )


def _best_of_drawn(learner: Learner, games: _Judged, seed: int) -> float:
    """Return the best makespan of `DRAWN` games with drawn bids on each instance, the mean over the instances.

    Members of a population play in turn.
    """
    policies = learner.policies() if isinstance(learner, GeneticPpo) else [learner.policy]
    generator = torch.Generator().manual_seed(seed)
    found = [_play(policies[number % len(policies)], games.board, generator).makespan for number in range(DRAWN)]
    return float((games.bound * torch.stack(found).amin(0)).mean())


@torch.no_grad()
def _play(network: ActorCritic, board: Board, generator: torch.Generator | None = None) -> _Played:
    """Play every game of a board to its end, greedily or with drawn bids."""
    state = reset(board)
    games, agents, candidates = board.shape
    best, everything = position(board, state), torch.arange(games)
    hops = torch.zeros(games)
    for _ in range(ROUNDS):
        scores = network(board, state)
        actions, _ = sample_actions(board, state, scores, PLANNING, 1.0 if generator else 0.0, generator)
        hops += ((actions >= 0) & (actions < agents * candidates)).sum(1)
        state = step(board, state, apply_moves(board, state, actions))
        best = best.improved_by(position(board, state), everything)
        if bool(state.done.all()):
            break
    return _Played(
        makespan=torch.where(best.unserved > 0, torch.inf, 1 / (1 - best.shortfall)),
        unserved=relative_makespan(board, state.group)[1].float(),
        battery=battery_left(board, state),
        hops=hops / agents,
        distance=best.distance / board.scale,
    )
