"""The trainer of networks for missions: generations of PPO, validation and breeding.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.algorithms.gappo import breed, fitness
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingStats
from alloc.allocators.learned.files.checkpoint import read_checkpoint, write_checkpoint
from alloc.allocators.learned.missions.feature_names import FEATURE_SET
from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.policy_file import save_network
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum
from alloc.allocators.learned.missions.training.evolution import Evolution
from alloc.allocators.learned.missions.training.ppo import MissionPpo
from alloc.allocators.learned.missions.training.validation import validate
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.member import MemberResult, Weights
from alloc.allocators.learned.training.report import Report, best_generation, next_report
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.allocators.parallel.serial import SerialEngine
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems.missions.files.document import mission_to_document

DEFAULT_PPO = PpoParameters(
    learning_rate=3e-4,
    max_learning_rate=3e-4,
    target_kl=0.012,
    gae_lambda=0.9,
    reward_scale=5.0,
    minibatch_size=4096,
)
"""Hyperparameters of PPO in missions: small steps, as it goes on from what was evolved."""


@dataclass(frozen=True)
class MissionTrainingParameters:
    """Parameters of a training in missions; together with the seed they decide the whole learning curve.

    Attributes
    ----------
    method : {"gappo", "ppo"}
    population : int
        Networks that learn; several are bred between generations.
    decisions : int
        Decisions of agents in a generation, for each network.
    missions : int
        Missions between two updates.
    validations : int
        Missions on which networks are compared.
    evolved : int
        Generations at the beginning in which the linear part of the network is evolved; then PPO goes on from it.
    candidates : int
        Of each of those.
    learner : PpoParameters
    breeding : BreedingParameters
    curriculum : MissionCurriculum
    """

    method: str = "gappo"
    population: int = 4
    decisions: int = 60_000
    missions: int = 12
    validations: int = 24
    evolved: int = 100
    candidates: int = 16
    learner: PpoParameters = DEFAULT_PPO
    breeding: BreedingParameters = field(default_factory=BreedingParameters)
    curriculum: MissionCurriculum = field(default_factory=MissionCurriculum)


class MissionJob(NamedTuple):
    """The training of one member in a generation, as it is sent to wherever it is run."""

    parameters: MissionTrainingParameters
    state: StateDict
    seed: int
    progress: float
    threads: int


def train_member(job: MissionJob) -> MemberResult:
    """Train a member and validate its network: a pure function of the job, wherever it is run."""
    parameters = job.parameters
    with plain_torch(), torch_threads(job.threads):
        learner = MissionPpo(parameters.learner)
        learner.load_state_dict(job.state)
        played = learner.train_on(
            parameters.curriculum, job.seed, parameters.decisions, parameters.missions, job.progress
        )
        validation = validate(learner.network, parameters.curriculum.validation(parameters.validations))
        policy = {name: weight.clone() for name, weight in learner.network.state_dict().items()}
        state = learner.state_dict()
    rate = float(state["optimiser"]["param_groups"][0]["lr"])
    evaluations = played.decisions * (1 + parameters.learner.update_epochs)
    stats = TrainingStats(played.decisions, evaluations, -played.cost, played.entropy, played.approx_kl, rate)
    return MemberResult(state, policy, stats, validation)


class MissionTrainer:
    """A training run in missions that can be stopped at any moment and resumed to the same learning curve.

    Parameters
    ----------
    parameters : MissionTrainingParameters, optional
    seed : int
        Seed of all random numbers.
    init : weights, optional
        Initial weights of all members.

    Attributes
    ----------
    members : list of StateDict
    history : list of Report
        One report per generation.
    best : list of weights
        The networks of the generation with the lowest cost, the best first.
    """

    def __init__(
        self, parameters: MissionTrainingParameters | None = None, seed: int = 0, init: Weights | None = None
    ) -> None:
        self.parameters, self.seed = parameters or MissionTrainingParameters(), seed
        learner = MissionPpo(self.parameters.learner, seed)
        if init is not None:
            learner.network.load_state_dict(init)
        self.members: list[StateDict] = [learner.state_dict()] * self.parameters.population
        weights = {name: weight.clone() for name, weight in learner.network.state_dict().items()}
        self.evolution = Evolution(weights, self.parameters.candidates, self.parameters.missions)
        self.history: list[Report] = []
        self.best: list[Weights] = []

    @property
    def generation(self) -> int:
        """Number of complete generations."""
        return len(self.history)

    @property
    def best_generation(self) -> int:
        """The generation with the best networks, 0 before the first."""
        return best_generation(self.history)

    def progress(self, limits: Limits) -> float:
        """Return the share of the training that is done; see `Limits.progress`."""
        return limits.progress(self.history)

    def is_over(self, limits: Limits) -> bool:
        """Whether a limit is reached."""
        return limits.reached(self.history)

    def advance(
        self,
        limits: Limits | None = None,
        engine: Engine | None = None,
        should_stop: Callable[[], bool] = never_stop,
    ) -> Report | None:
        """Train, validate and breed one generation; see `Trainer.advance`."""
        began, engine = time.monotonic(), engine or SerialEngine()
        progress, is_evolving = self.progress(limits or Limits()), self.generation < self.parameters.evolved
        results = (self._evolve if is_evolving else self._train)(progress, engine, should_stop)
        if results is None:
            return None
        scores = self._fitness(results)
        ranking = sorted(range(len(results)), key=lambda member: results[member].validation.cost)
        report = next_report(self.history, results, ranking[0], max(scores), time.monotonic() - began)
        if not self.history or report.cost < self.history[-1].best_cost:
            self.best = [results[member].policy for member in ranking]
        self.history.append(report)
        if not is_evolving:
            self.members = [one.state for one in results]
            if len(self.members) > 1:
                self.members = breed(self.members, scores, self.parameters.breeding, self._seed(len(self.members)))
        return report

    def _train(self, progress: float, engine: Engine, should_stop: Callable[[], bool]) -> list[MemberResult] | None:
        """Train and validate all members."""
        jobs = [
            MissionJob(self.parameters, state, self._seed(member), progress, engine.threads)
            for member, state in enumerate(self.members)
        ]
        return engine.map(train_member, jobs, should_stop)

    def _evolve(self, progress: float, engine: Engine, should_stop: Callable[[], bool]) -> list[MemberResult] | None:
        """Evolve the linear part of the network for a generation; all members then begin with it."""
        parameters = self.parameters
        weights = self.evolution.advance(parameters.curriculum, self._seed(0), progress, engine, should_stop)
        if weights is None:
            return None
        learner = MissionPpo(parameters.learner)
        learner.network.load_state_dict(weights)
        validation = validate(learner.network, parameters.curriculum.validation(parameters.validations))
        self.members = [learner.state_dict()] * parameters.population
        missions = parameters.candidates * parameters.missions
        stats = TrainingStats(0, missions, validation.reward, 0.0, 0.0, parameters.learner.learning_rate)
        return [MemberResult(self.members[0], weights, stats, validation)]

    def _fitness(self, results: Sequence[MemberResult]) -> list[float]:
        """Return the fitness (12) of all members."""
        rewards = [one.validation.reward for one in results]
        entropies, evaluations = [one.stats.entropy for one in results], [one.stats.evaluations for one in results]
        return fitness(rewards, entropies, evaluations, self.parameters.breeding)

    def _seed(self, number: int) -> int:
        mixed = np.random.SeedSequence((self.seed, self.generation, number)).generate_state(1, np.uint64)
        return int(mixed[0] >> np.uint64(1))

    def save(self, path: Path) -> None:
        """Write a checkpoint of the whole run, from which `resume` continues as without a break."""
        state = {
            "members": self.members,
            "history": [asdict(report) for report in self.history],
            "best": self.best,
            "evolution": self.evolution.state_dict(),
        }
        write_checkpoint(path, self._description(), state)

    def resume(self, path: Path) -> None:
        """Restore the run of a checkpoint; see `Trainer.resume`."""
        state = read_checkpoint(path, self._description())
        self.members, self.best = state["members"], state["best"]
        self.evolution.load_state_dict(state["evolution"])
        self.history = [Report(**report) for report in state["history"]]

    def _description(self) -> dict[str, str]:
        """Return all that decides the learning curve, as text."""
        parameters, missions = self.parameters, self.parameters.curriculum.missions
        plain = {name: str(value) for name, value in vars(parameters).items() if name != "curriculum"}
        drawn = {name: str(value) for name, value in vars(parameters.curriculum).items() if name != "missions"}
        digests = [hashlib.sha256(repr(mission_to_document(one)).encode()).hexdigest()[:8] for one in missions]
        return {"seed": str(self.seed), "features": FEATURE_SET, **plain, **drawn, "missions": ", ".join(digests)}

    def write_policy(self, path: Path) -> None:
        """Write the best network up to now to a policy file."""
        network, report = MissionNetwork(), self.history[self.best_generation - 1]
        network.load_state_dict(self.best[0])
        figures: dict[str, str | float] = {
            "seed": self.seed,
            "generation": report.generation,
            "decisions": report.decisions,
            "validation_time": round(report.time, 6),
            "validation_distance": round(report.distance, 6),
        }
        save_network(path, network, self.parameters.method, figures)
