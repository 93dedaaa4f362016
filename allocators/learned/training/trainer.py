"""Training: lessons for every member, validation, and the next generation; again and again.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import copy
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

from alloc.allocators.learned.algorithms.gappo import breed, fitness
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, GappoParameters
from alloc.allocators.learned.algorithms.learner import Lesson, LessonReport
from alloc.allocators.learned.algorithms.registry import new_learner
from alloc.allocators.learned.files.checkpoint import described, read_checkpoint, write_checkpoint
from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import NetworkSize, uninitialised
from alloc.allocators.learned.training.curriculum import Curriculum
from alloc.allocators.learned.training.log import TrainingLog
from alloc.allocators.learned.training.validation import Validation, validate, validation_boards
from alloc.allocators.parallel.engine import Engine, SerialEngine
from alloc.problems import InputError
from alloc.problems.arguments import whole
from alloc.problems.game import PLANNING, Board, Rules

Weights = dict[str, torch.Tensor]


@dataclass(frozen=True)
class TrainingParameters:
    """Shape of a training run; together with the seed it decides the whole curve.

    Attributes
    ----------
    method : str
        Of `methods.METHODS`.
    population : int
        Members that learn; where there are several, they are bred between generations.
    decisions : int
        Decisions of agents in a lesson: one member's share of a generation.
    network : NetworkSize
    learner : parameters of the method
        Such as `PpoParameters`.
    breeding : BreedingParameters
    curriculum : Curriculum
    rules : Rules
    """

    method: str = "gappo"
    population: int = 4
    decisions: int = 20_000
    network: NetworkSize = field(default_factory=NetworkSize)
    learner: Any = field(default_factory=GappoParameters)
    breeding: BreedingParameters = field(default_factory=BreedingParameters)
    curriculum: Curriculum = field(default_factory=Curriculum)
    rules: Rules = PLANNING

    def __post_init__(self) -> None:
        if whole(self.population, "population", 1) > 1 and self.method == "ddpg":
            raise InputError("breeding crosses single networks, ddpg has an actor and a critic; use 1", "population")


@dataclass(frozen=True)
class Limits:
    """When training ends, whatever comes first; all count from the beginning of the run.

    Attributes
    ----------
    steps : int or None
        Decisions of agents, those of all members together.
    iterations : int or None
        Generations.
    minutes : float or None
    patience : int or None
        Generations in a row without better networks.
    """

    steps: int | None = None
    iterations: int | None = None
    minutes: float | None = None
    patience: int | None = None


@dataclass(frozen=True)
class Report:
    """What a generation brought; one line of the log.

    Attributes
    ----------
    generation : int
        From 1.
    decisions, evaluations : int
        Decisions of agents and states evaluated by networks up to now, by all members together.
    cost, unserved, time, distance, others_time : float
        Of the best member; see `Validation`.
    best_cost : float
        The least cost up to now.
    fitness : float
        (12) of the fittest member.
    reward, entropy, divergence, learning_rate : float
        Of the best member's lesson; see `LessonReport`.
    seconds : float
        Time of training up to now.
    decisions_per_second : float
        In this generation.
    """

    generation: int
    decisions: int
    evaluations: int
    cost: float
    unserved: float
    time: float
    distance: float
    others_time: float
    best_cost: float
    fitness: float
    reward: float
    entropy: float
    divergence: float
    learning_rate: float
    seconds: float
    decisions_per_second: float


class _Assignment(NamedTuple):
    """A lesson for a learner, as it travels to wherever it is taken."""

    parameters: TrainingParameters
    state: dict[str, Any]
    lesson: Lesson
    boards: Sequence[Board]


class _Taught(NamedTuple):
    """What came of it."""

    state: dict[str, Any]
    policy: Weights
    report: LessonReport
    validation: Validation


def teach(assignment: _Assignment) -> _Taught:
    """Take a lesson and play the validation games: a pure function, the same wherever it runs."""
    parameters = assignment.parameters
    learner = new_learner(parameters.method, parameters.network, parameters.learner, 0)
    learner.load(copy.deepcopy(assignment.state))  # optimisers go on writing where their state came from
    report = learner.take(assignment.lesson)
    validation = validate(learner.policy, assignment.boards, parameters.rules, parameters.curriculum)
    policy = {name: weight.clone() for name, weight in learner.policy.state_dict().items()}
    return _Taught(learner.state(), policy, report, validation)


class Trainer:
    """A training run that can be stopped at any moment and taken up again to the same curve.

    Parameters
    ----------
    parameters : TrainingParameters, optional
    seed : int
        Source of all randomness.
    boards : sequence of Board, optional
        Validation games; those of the curriculum by default.
    init : sequence of weights, optional
        What the policies of the members begin with, in turn; by default all begin with the same random weights, so
        that those of two members can be blended.

    Attributes
    ----------
    history : list of Report
    best : list of weights
        The networks of the generation with the least cost up to now, the best first.
    """

    def __init__(
        self,
        parameters: TrainingParameters | None = None,
        seed: int = 0,
        boards: Sequence[Board] | None = None,
        init: Sequence[Weights] = (),
    ) -> None:
        self.parameters, self.seed = parameters or TrainingParameters(), seed
        self.boards = validation_boards(self.parameters.curriculum) if boards is None else boards
        self.members = [self._new_member(init[number % len(init)] if init else None) for number in range(self._count)]
        self.history: list[Report] = []
        self.best: list[Weights] = []

    @property
    def _count(self) -> int:
        return self.parameters.population

    def _new_member(self, weights: Weights | None) -> dict[str, Any]:
        learner = new_learner(self.parameters.method, self.parameters.network, self.parameters.learner, self.seed)
        if weights is not None:
            learner.policy.load_state_dict(weights)
        state = learner.state()
        for target, source in (("target", "network"), ("targets", "networks")):
            if target in state:  # target networks begin as copies, of given weights as well
                state[target] = copy.deepcopy(state[source])
        return state

    @property
    def generation(self) -> int:
        """Number of generations that are complete."""
        return len(self.history)

    @property
    def best_generation(self) -> int:
        """The generation that brought the best networks, 0 before the first."""
        costs = [report.cost for report in self.history]
        return 1 + int(np.argmin(costs)) if costs else 0

    def progress(self, limits: Limits) -> float:
        """Return the share of the training that is behind: of the steps, else of the generations, else of the time."""
        last = self.history[-1] if self.history else None
        for limit, done in (
            (limits.steps, last.decisions if last else 0),
            (limits.iterations, self.generation),
            (limits.minutes and 60 * limits.minutes, last.seconds if last else 0.0),
        ):
            if limit is not None:
                return min(1.0, done / limit) if limit > 0 else 1.0
        return 0.0

    def is_over(self, limits: Limits) -> bool:
        """Whether a limit is met."""
        last = self.history[-1] if self.history else None
        return (
            (limits.steps is not None and (last.decisions if last else 0) >= limits.steps)
            or (limits.iterations is not None and self.generation >= limits.iterations)
            or (limits.minutes is not None and (last.seconds if last else 0.0) >= 60 * limits.minutes)
            or (limits.patience is not None and self.generation - self.best_generation >= max(1, limits.patience))
        )

    def advance(
        self,
        limits: Limits | None = None,
        engine: Engine | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> Report | None:
        """Train, judge and breed one generation.

        Parameters
        ----------
        limits : Limits, optional
            How far training goes, for its schedules.
        engine : Engine, optional
            Where the lessons are taken; one after the other by default.

        Returns
        -------
        Report or None
            None if `should_stop` said so before the generation was complete; nothing is changed then.
        """
        began = time.monotonic()
        assignments = [
            _Assignment(self.parameters, member, self._lesson(number, limits or Limits()), self.boards)
            for number, member in enumerate(self.members)
        ]
        taught = (engine or SerialEngine()).map(teach, assignments, should_stop)
        if taught is None:
            return None
        scores = fitness(
            [one.validation.reward for one in taught],
            [one.report.entropy for one in taught],
            [one.report.evaluations for one in taught],
            self.parameters.breeding,
        )
        order = sorted(range(len(taught)), key=lambda number: taught[number].validation.cost)
        report = self._report(taught, order[0], max(scores), time.monotonic() - began)
        if not self.history or report.cost < self.history[-1].best_cost:
            self.best = [taught[number].policy for number in order]
        self.history.append(report)
        self.members = [one.state for one in taught]
        if self._count > 1:
            self.members = breed(
                self.members, scores, self.parameters.breeding, _seed(self.seed, self.generation, self._count)
            )
        return report

    def _lesson(self, member: int, limits: Limits) -> Lesson:
        parameters, decisions = self.parameters, self.parameters.decisions
        if limits.steps is not None:
            left = limits.steps - (self.history[-1].decisions if self.history else 0)
            decisions = max(1, min(decisions, -(-left // self._count)))
        seed = _seed(self.seed, self.generation, member)
        return Lesson(seed, decisions, parameters.curriculum, self.progress(limits), parameters.rules)

    def _report(self, taught: Sequence[_Taught], best: int, fittest: float, seconds: float) -> Report:
        decisions = sum(one.report.decisions for one in taught)
        last = self.history[-1] if self.history else None
        validation, report = taught[best].validation, taught[best].report
        return Report(
            generation=self.generation + 1,
            decisions=decisions + (last.decisions if last else 0),
            evaluations=sum(one.report.evaluations for one in taught) + (last.evaluations if last else 0),
            cost=validation.cost,
            unserved=validation.unserved,
            time=validation.time,
            distance=validation.distance,
            others_time=validation.others_time,
            best_cost=min(validation.cost, last.best_cost if last else np.inf),
            fitness=fittest,
            reward=report.reward,
            entropy=report.entropy,
            divergence=report.divergence,
            learning_rate=report.learning_rate,
            seconds=seconds + (last.seconds if last else 0.0),
            decisions_per_second=decisions / max(seconds, 1e-9),
        )

    def save(self, path: Path) -> None:
        """Store the whole run, so that `resume` goes on as if nothing had happened."""
        state = {
            "members": self.members,
            "history": [asdict(report) for report in self.history],
            "best": self.best,
        }
        write_checkpoint(path, described(self.parameters, self.seed), state)

    def resume(self, path: Path) -> None:
        """Take up the run stored at `path`.

        Raises
        ------
        InputError
            If there is no checkpoint of this version at `path`, or it is one of another method, seed or parameters.
        """
        state = read_checkpoint(path, described(self.parameters, self.seed))
        self.members, self.best = state["members"], state["best"]
        self.history = [Report(**report) for report in state["history"]]

    def write_policy(self, path: Path) -> None:
        """Write the best networks up to now."""
        networks = []
        for weights in self.best:
            network = uninitialised(self.parameters.network)
            network.load_state_dict(weights)
            networks.append(network)
        figures = self.history[self.best_generation - 1]
        save_policy(
            path,
            networks,
            self.parameters.method,
            {
                "seed": self.seed,
                "generation": figures.generation,
                "decisions": figures.decisions,
                "validation_time": round(figures.time, 6),
                "validation_distance": round(figures.distance, 6),
                "turn": str(self.parameters.rules.turn),
                "reward": str(self.parameters.rules.reward),
            },
        )


def _seed(*numbers: int) -> int:
    """Mix numbers to the seed of a generator."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> np.uint64(1))


def train(
    trainer: Trainer,
    output: Path,
    *,
    checkpoint: Path,
    log: Path,
    limits: Limits,
    tensorboard: Path | None = None,
    engine: Engine | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    on_report: Callable[[Report], None] = lambda report: None,
) -> None:
    """Train until a limit is met, storing checkpoint, policy and log after every generation.

    The checkpoint is written first and holds what the others say, so that a run that is killed between two of the
    files puts them right when it is taken up.

    Parameters
    ----------
    output : Path
        Policy file: the best networks up to now, those of all members, the best first.
    checkpoint, log : Path
        Whole run, and one CSV line per generation.
    limits : Limits
    tensorboard : Path, optional
        Folder for event files.
    engine : Engine, optional
        Where lessons are taken; one after the other by default.
    should_stop : callable
        As `Engine.map` has it; what the unfinished generation brought is dropped.
    on_report : callable
        Called with every `Report`.
    """
    trainer.save(checkpoint)
    if trainer.best:
        trainer.write_policy(output)
    with TrainingLog(Report, log, tensorboard, trainer.history) as lines:
        while not trainer.is_over(limits) and not should_stop():
            report = trainer.advance(limits, engine, should_stop)
            if report is None:
                return
            try:
                trainer.save(checkpoint)
            finally:  # one of the two may have room
                if report.generation == trainer.best_generation:
                    trainer.write_policy(output)
            lines.append(report)
            on_report(report)
