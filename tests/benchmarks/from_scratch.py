"""Learning from scratch: `gappo` against its four rivals and against itself without each of its parts.

    python tests/benchmarks/from_scratch.py --runs docs/benchmarks/from_scratch.csv --seeds 10 --publish

Every run begins with random weights, makes the same number of decisions of agents, all members of a population
together, and is judged ten times on the way by greedy games on instances of the paper's scenario 1, which is never
trained on. Runs that the file has are not made again; all methods of a seed come before the next seed.
"""

import argparse
import csv
import json
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from time import perf_counter

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import torch
from from_scratch_report import publish

from alloc.allocators.learned.algorithms.registry import method_parameters, new_learner
from alloc.allocators.learned.network.actor_critic import ActorCritic, NetworkSize
from alloc.allocators.learned.play.action_sampling import sample_actions
from alloc.allocators.learned.play.rollout import position
from alloc.allocators.learned.training.curriculum import Curriculum, reference_board
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.parameters import TrainingParameters
from alloc.allocators.learned.training.trainer import Trainer
from alloc.allocators.learned.training.validation import VALIDATION_SEED
from alloc.problems.game import PLANNING, Board, apply_moves, battery_left, relative_makespan, reset, step
from alloc.problems.generate import paper, paper_like

PRICE = 0.3
"""Weight of energy, in training and tests alike."""

GAMES = Curriculum(
    families=("paper",),
    initial_tasks=(4, 8),
    tasks=(4, 10),
    max_agents=50,
    energy_weight=(PRICE, PRICE),
    max_pairs=1200,
    games=(4, 48),
    relaxed_fraction=0.0,
)
"""What is trained on: like the paper's scenarios, at most half as large as the first; few games per update, since
decisions are few."""

POPULATION = 3
"""Members of `gappo`."""

POINTS = 10
"""Generations of a run, and evaluations after the first."""

TEST_SEED, TEST_GAMES = 5000, 12
"""Instances of scenario 1 on which all are judged."""

FITNESS_GAMES = 6
"""Games by which the members are compared; of the sizes that are trained on."""

ROUNDS = 60
"""Most rounds of a game in an evaluation; nobody returns to a task, so that games end long before."""

LITTLE = 1e-6
"""Price of energy where it shall not count."""


Settings = dict[str, str]

_KEPT = Path(__file__).with_name("from_scratch_tuned.json")
TUNED: dict[str, Settings] = json.loads(_KEPT.read_text(encoding="utf-8"))
"""What `from_scratch_tuning.py` found best for each method, in as many trials, at this budget and in these games."""


@dataclass(frozen=True)
class Variant:
    """A method, with parts of it changed."""

    method: str
    settings: Settings
    population: int = 1
    attention: bool = True
    price: float = PRICE


GAPPO = Variant("gappo", TUNED["gappo"], POPULATION)
VARIANTS = {
    "gappo": GAPPO,
    **{name: Variant(name, TUNED[name]) for name in ("ppo", "a2c", "dqn", "ddpg")},
    "no GA": replace(GAPPO, population=1),
    "no attention": replace(GAPPO, attention=False),
    "no adaptive rate": replace(GAPPO, settings={**TUNED["gappo"], "target_kl": "none"}),
    "no energy term": replace(GAPPO, price=LITTLE),
    "no replay": replace(GAPPO, settings={**TUNED["gappo"], "buffer_size": "0"}),
}


@dataclass(frozen=True)
class Row:
    """A run at one of its evaluations; means over the test games.

    Attributes
    ----------
    variant, seed, budget, point
        Which run, and which evaluation of it, from 0 before any training.
    decisions, evaluations : int
        Decisions of agents and states evaluated by networks, by all members together.
    time, mean_time : float
        Makespan in hours at the best position of a game: the median game, and the mean, which a single game with a
        neglected task can move far.
    end_time : float
        Makespan in hours of the tasks that are served at the end of a game, the median.
    unserved : float
        Tasks left unserved at the end of a game.
    distance : float
        Mean distance per agent at the best position, flown directly, as an edge of the unit cube is 1.
    battery : float
        Share of the battery left at the end of the episode, where every hop was flown.
    hops : float
        Moves per agent in an episode.
    compared : float
        Decisions in the games by which members were compared up to now, about: not among `decisions`, since nobody
        learns from them; 0 where there is nobody to compare.
    seconds : float
        Time of the training.
    """

    variant: str
    seed: int
    budget: int
    point: int
    decisions: int
    evaluations: int
    time: float
    mean_time: float
    end_time: float
    unserved: float
    distance: float
    battery: float
    hops: float
    compared: float
    seconds: float


def parameters_of(variant: Variant, budget: int) -> TrainingParameters:
    """Return what the trainer needs: defaults wherever the variant says nothing."""
    return TrainingParameters(
        method=variant.method,
        population=variant.population,
        decisions=-(-budget // (POINTS * variant.population)),
        network=NetworkSize(attention=variant.attention),
        learner=method_parameters(variant.method, variant.settings),
        curriculum=replace(GAMES, energy_weight=(variant.price, variant.price)),
    )


def games(price: float, *, tests: bool) -> Board:
    """Return the games of the test, or those of the fitness."""
    if tests:
        instances = [paper(1, TEST_SEED + number) for number in range(TEST_GAMES)]
    else:
        instances = [paper_like(40, 8, 160, VALIDATION_SEED + number) for number in range(FITNESS_GAMES)]
    return reference_board(instances, [price] * len(instances), np.random.default_rng(0))


@torch.no_grad()
def judged(network: ActorCritic, board: Board) -> dict[str, float]:
    """Play greedily to the end, and return what a `Row` says of the games."""
    state = reset(board)
    best, hops, everything = position(board, state), 0.0, torch.arange(len(board.energy_weight))
    for _ in range(ROUNDS):
        actions, _ = sample_actions(board, state, network(board, state), PLANNING)
        hops += float(((actions >= 0) & (actions < board.shape[1] * board.shape[2])).sum())
        state = step(board, state, apply_moves(board, state, actions))
        best = best.improved_by(position(board, state), everything)
        if bool(state.done.all()):
            break
    time = 1 / (1 - best.shortfall)
    end_time, unserved = relative_makespan(board, state.group)
    return {
        "time": float(time.median()),
        "mean_time": float(time.mean()),
        "end_time": float(end_time.median()),
        "unserved": float(unserved.float().mean()),
        "distance": float((best.distance / board.scale).mean()),
        "battery": float(battery_left(board, state).mean()),
        "hops": hops / (board.shape[0] * board.shape[1]),
    }


def fittest(trainer: Trainer) -> ActorCritic:
    """Return the network of the fittest member, which breeding puts first."""
    parameters = trainer.parameters
    learner = new_learner(parameters.method, parameters.network, parameters.learner, 0)
    learner.load_state_dict(trainer.members[0])
    return learner.policy


def run(name: str, seed: int, budget: int) -> Iterator[Row]:
    """Train one variant from nothing."""
    variant = VARIANTS[name]
    fitness_games, tests = games(variant.price, tests=False), games(variant.price, tests=True)
    trainer = Trainer(parameters_of(variant, budget), seed, [fitness_games])
    limits = Limits(steps=budget)
    compared = spent = 0.0
    yield Row(name, seed, budget, 0, 0, 0, **judged(fittest(trainer), tests), compared=0.0, seconds=0.0)
    while not trainer.is_over(limits):
        began = perf_counter()
        report = trainer.advance(limits)
        spent += perf_counter() - began
        assert report is not None
        network = fittest(trainer)
        if variant.population > 1:
            compared += variant.population * fitness_games.ability.numel() * judged(network, fitness_games)["hops"]
        yield Row(
            name,
            seed,
            budget,
            report.generation,
            report.decisions,
            report.evaluations,
            **judged(network, tests),
            compared=compared,
            seconds=spent,
        )


def read(path: Path) -> list[Row]:
    """Return the rows of a file, none where there is no such file."""
    if not path.exists():
        return []
    kinds = {field.name: field.type for field in fields(Row)}
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Row(**{name: kinds[name](text) for name, text in line.items()})  # type: ignore[operator]
            for line in csv.DictReader(file)
        ]


def write(path: Path, rows: list[Row]) -> None:
    """Append the rows of a run that is complete."""
    fresh = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if fresh:
            table.writeheader()
        for row in rows:
            table.writerow({key: f"{v:.6g}" if isinstance(v, float) else v for key, v in asdict(row).items()})


def main() -> None:
    """Make the runs that are asked for, and publish."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=Path, metavar="CSV", required=True, help="keep all runs there")
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=list(VARIANTS))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--decisions", type=int, default=60_000, help="of agents, per run")
    parser.add_argument(
        "--publish",
        action="store_true",
        help="put tables and plot into docs/benchmarks/from_scratch.md, of the seeds that all variants have",
    )
    options = parser.parse_args()
    torch.set_num_threads(1)
    done = {(row.variant, row.seed, row.budget) for row in read(options.runs)}
    for seed in range(options.seeds):
        for name in options.variants:
            if (name, seed, options.decisions) not in done:
                rows = list(run(name, seed, options.decisions))
                write(options.runs, rows)
                last = rows[-1]
                print(
                    f"{name}, seed {seed}: T {last.time:.4f}, distance {last.distance:.3f}, battery {last.battery:.3f},"
                    f" {last.decisions} decisions, {last.seconds:.0f} s",
                    file=sys.stderr,
                    flush=True,
                )
    if options.publish:
        wanted = [row for row in read(options.runs) if row.budget == options.decisions]
        publish([row for row in wanted if row.variant in options.variants], options.decisions)


if __name__ == "__main__":
    main()
