"""Training of GAPPO: PPO on every member, fitness on validation games, the next generation; again and again.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import copy
import csv
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch

from alloc.allocators.learned.curriculum import Curriculum, validation_boards
from alloc.allocators.learned.network import ActorCritic, NetworkSize
from alloc.allocators.learned.policy_file import save_policy
from alloc.allocators.learned.population import BreedingParameters, Member, breed, fitness, new_member
from alloc.allocators.learned.ppo import PpoParameters, UpdateStatistics, collect, update
from alloc.allocators.learned.rollout import play
from alloc.problems import InputError
from alloc.problems.game import Board, State, begin, group_ability, value_of

CHECKPOINT_FORMAT = "alloc-checkpoint/1"


@dataclass(frozen=True)
class TrainingParameters:
    """Shape of a training run.

    Attributes
    ----------
    population : int
        Members.
    updates_per_generation : int
        PPO updates of each member between two generations.
    learning_rate : float
        First step size; adapted by the divergence, and by mutation.
    decay : float
        Factor per generation on three times that, the most that a step size may grow to.
    network : NetworkSize
    ppo : PpoParameters
    breeding : BreedingParameters
    curriculum : Curriculum
    """

    population: int = 4
    updates_per_generation: int = 10
    learning_rate: float = 1e-3
    decay: float = 0.96
    network: NetworkSize = field(default_factory=NetworkSize)
    ppo: PpoParameters = field(default_factory=PpoParameters)
    breeding: BreedingParameters = field(default_factory=BreedingParameters)
    curriculum: Curriculum = field(default_factory=Curriculum)


@dataclass(frozen=True)
class Validation:
    """How one network plays the validation games, at the best position of each.

    Attributes
    ----------
    reward : float
        Rise of potential less energy.
    shortfall : float
        Mean over games of 1 - T_ref / T.
    distance : float
        Mean distance per agent, in the board's scale.
    """

    reward: float
    shortfall: float
    distance: float


@dataclass(frozen=True)
class Report:
    """What a generation brought; one line of the log."""

    generation: int
    seconds: float
    fitness: float
    reward: float
    shortfall: float
    distance: float
    entropy: float
    divergence: float
    learning_rate: float
    evaluations: int


class Trainer:
    """A training run that can be stopped after any generation and taken up again to the same curve."""

    def __init__(self, parameters: TrainingParameters | None = None, seed: int = 0) -> None:
        self.parameters = parameters or TrainingParameters()
        self.seed, self.generation, self.seconds, self.evaluations = seed, 0, 0.0, 0
        self.rng = np.random.default_rng(seed)
        self.generator = torch.Generator().manual_seed(seed)
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            first = ActorCritic(self.parameters.network)
        self.members = [
            new_member(copy.deepcopy(first), self.parameters.learning_rate) for _ in range(self.parameters.population)
        ]
        self.scores = [0.0] * len(self.members)
        self._validation = validation_boards()

    def advance(self, should_stop: Callable[[], bool] = lambda: False) -> Report | None:
        """Train, judge and breed one generation.

        Returns
        -------
        Report or None
            None if `should_stop`, asked between updates, said so: the generation then is unfinished, and the run can
            only be taken up from its last checkpoint.
        """
        began = time.monotonic()
        statistics, costs = [], []
        boards = [self.parameters.curriculum.draw(self.rng) for _ in range(self.parameters.updates_per_generation)]
        for member in self.members:
            member_statistics, cost = self._train(member, boards, should_stop)
            if should_stop():
                return None
            statistics.append(member_statistics)
            costs.append(cost)
        self.evaluations += sum(costs)
        results = [self.validate(member.network) for member in self.members]
        entropies = [member_statistics.entropy for member_statistics in statistics]
        self.scores = fitness([r.reward for r in results], entropies, costs, self.parameters.breeding)
        best = int(np.argmax(self.scores))
        self.seconds += time.monotonic() - began
        report = Report(
            self.generation,
            self.seconds,
            self.scores[best],
            **asdict(results[best]),
            entropy=entropies[best],
            divergence=statistics[best].divergence,
            learning_rate=self.members[best].learning_rate,
            evaluations=self.evaluations,
        )
        self.generation += 1
        self.members = breed(
            self.members, self.scores, self.parameters.breeding, self.seed * 1_000_003 + self.generation
        )
        return report

    def _train(
        self, member: Member, boards: Sequence[Board], should_stop: Callable[[], bool]
    ) -> tuple[UpdateStatistics, int]:
        """Update one member on every board, the same for all members; also return the network evaluations it took."""
        curriculum, ppo = self.parameters.curriculum, self.parameters.ppo
        cost, result = 0, UpdateStatistics(0.0, 0.0, 0)
        highest = 3 * self.parameters.learning_rate * self.parameters.decay**self.generation
        for board in boards:
            if should_stop():
                break
            played = collect(member.network, board, curriculum.steps(board), ppo, self.generator)
            result = update(member.network, member.optimiser, board, played, ppo, self.generator, highest)
            cost += int(played.alive.sum()) * (1 + ppo.epochs)
        return result, cost

    def validate(self, network: ActorCritic) -> Validation:
        """Play the validation games, greedily and by the rules of `play`."""
        outcomes = [_outcome(network, board, self.parameters.curriculum.steps(board)) for board in self._validation]
        reward, shortfall, distance = (torch.cat(part).mean().item() for part in zip(*outcomes, strict=True))
        return Validation(reward, shortfall, distance)

    def save(self, path: Path) -> None:
        """Store the whole run, so that `resume` goes on as if nothing had happened."""
        beside = path.with_name(path.name + ".part")
        torch.save(self._state(), beside)
        beside.replace(path)

    def _state(self) -> dict[str, Any]:
        return {
            "format": CHECKPOINT_FORMAT,
            "seed": self.seed,
            "generation": self.generation,
            "seconds": self.seconds,
            "evaluations": self.evaluations,
            "network": asdict(self.parameters.network),
            "numpy": json.dumps(self.rng.bit_generator.state),
            "torch": self.generator.get_state(),
            "members": [(m.network.state_dict(), m.optimiser.state_dict()) for m in self.members],
        }

    @classmethod
    def resume(cls, path: Path, parameters: TrainingParameters | None = None) -> "Trainer":
        """Take up the run stored at `path`.

        Raises
        ------
        InputError
            If there is no checkpoint of this version and population at `path`.
        """
        try:
            state = torch.load(path, weights_only=True)
            if state["format"] != CHECKPOINT_FORMAT:
                raise KeyError(state["format"])
        except FileNotFoundError:
            raise InputError("no such checkpoint", "", str(path)) from None
        except Exception as error:
            reason = next(iter(str(error).splitlines()), type(error).__name__)[:100]
            raise InputError(f"is not a checkpoint of this version ({reason})", "", str(path)) from None
        trainer = cls(parameters, seed=state["seed"])
        if len(state["members"]) != len(trainer.members) or state["network"] != asdict(trainer.parameters.network):
            raise InputError("was made with another population or network size; use the same", "", str(path))
        trainer.generation, trainer.seconds = state["generation"], state["seconds"]
        trainer.evaluations = state["evaluations"]
        trainer.rng.bit_generator.state = json.loads(state["numpy"])
        trainer.generator.set_state(state["torch"])
        for member, (network, optimiser) in zip(trainer.members, state["members"], strict=True):
            member.network.load_state_dict(network)
            member.optimiser.load_state_dict(optimiser)
        return trainer


def _outcome(network: ActorCritic, board: Board, steps: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return rise of value, shortfall and distance at the best position of each game, each of shape (B,)."""
    best = play(network, board, steps=steps)
    start = begin(board)
    end = State(best.task, group_ability(board, best.task), start.done)
    rise = value_of(board, end) - value_of(board, start)
    return rise, 1 - 1 / best.time.clamp(min=1), best.distance


def train(
    trainer: Trainer,
    output: Path,
    *,
    checkpoint: Path,
    log: Path,
    generations: int | None = None,
    minutes: float | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    on_report: Callable[[Report], None] = lambda report: None,
) -> None:
    """Train until a limit is met, storing policy, checkpoint and log after every generation.

    Parameters
    ----------
    output : Path
        Policy file: all members, the fittest first.
    checkpoint, log : Path
        Whole run, and one CSV line per generation.
    generations : int, optional
        Generation after which to stop, counted from the beginning of the run.
    minutes : float, optional
        Training time after which to stop, counted from the beginning of the run.
    should_stop : callable
        Asked between updates; what the unfinished generation brought is dropped.
    on_report : callable
        Called with every `Report`.
    """
    while not should_stop():
        if generations is not None and trainer.generation >= generations:
            return
        if minutes is not None and trainer.seconds >= 60 * minutes:
            return
        report = trainer.advance(should_stop)
        if report is None:
            return
        save_policy(output, [member.network for member in trainer.members], "gappo")
        trainer.save(checkpoint)
        _append(log, report)
        on_report(report)


def _append(log: Path, report: Report) -> None:
    new = not log.exists()
    with log.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if new:
            writer.writerow(column.name for column in fields(Report))
        writer.writerow(asdict(report).values())
