"""The trainer of networks for missions: generations of PPO, validation and breeding.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import hashlib
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters, PpoParameters
from alloc.allocators.learned.algorithms.learner import TrainingStats
from alloc.allocators.learned.missions.feature_names import FEATURE_SET
from alloc.allocators.learned.missions.network import MissionNetwork
from alloc.allocators.learned.missions.policy_file import save_network
from alloc.allocators.learned.missions.training.curriculum import MissionCurriculum
from alloc.allocators.learned.missions.training.evolution import FINE_STEP, STEP, Evolution
from alloc.allocators.learned.missions.training.ppo import MissionPpo
from alloc.allocators.learned.missions.training.validation import validate
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.member import MemberResult, Weights
from alloc.allocators.learned.training.population import PopulationTraining
from alloc.allocators.learned.training.report import Report
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.allocators.parallel.serial import SerialEngine
from alloc.allocators.runtime.torch_state import plain_torch, torch_threads
from alloc.problems.missions.files.document import mission_to_document

DEFAULT_PPO = PpoParameters(
    learning_rate=1e-2,
    max_learning_rate=1e-2,
    target_kl=0.012,
    minibatch_size=1024,
)
"""Hyperparameters of PPO in missions; with a tenth of the rate, the policy hardly changes (divergence below 1e-4)."""


@dataclass(frozen=True)
class MissionTrainingParameters:
    """Parameters of a training in missions; together with the seed, they determine the learning curve.

    Attributes
    ----------
    method : {"gappo", "ppo"}
    population : int
        Number of networks that learn; several are bred between generations.
    decisions : int
        Decisions of agents per generation and network.
    missions : int
        Number of missions on which candidates are compared.
    groups : int
        Number of missions between two updates of PPO.
    validations : int
        Number of missions on which networks are compared.
    evolved : int
        Number of initial generations of evolution, after which PPO continues.
    candidates : int
        Number of candidates in each of these generations.
    learner : PpoParameters
    breeding : BreedingParameters
    curriculum : MissionCurriculum
    """

    method: str = "gappo"
    population: int = 4
    decisions: int = 60_000
    missions: int = 12
    groups: int = 4
    validations: int = 64
    evolved: int = 100
    candidates: int = 16
    learner: PpoParameters = DEFAULT_PPO
    breeding: BreedingParameters = field(default_factory=BreedingParameters)
    curriculum: MissionCurriculum = field(default_factory=MissionCurriculum)


class MissionJob(NamedTuple):
    """The training of one member in a generation, in a form that can be sent to another process."""

    parameters: MissionTrainingParameters
    state: StateDict
    seed: int
    progress: float
    threads: int


def train_member(job: MissionJob) -> MemberResult:
    """Train a member and validate its network; a pure function of the job."""
    parameters = job.parameters
    with plain_torch(), torch_threads(job.threads):
        learner = MissionPpo(parameters.learner)
        learner.load_state_dict(job.state)
        played = learner.train_on(
            parameters.curriculum, job.seed, parameters.decisions, parameters.groups, job.progress
        )
        validation = validate(learner.network, parameters.curriculum.validation(parameters.validations))
        policy = {name: weight.clone() for name, weight in learner.network.state_dict().items()}
        state = learner.state_dict()
    rate = float(state["optimiser"]["param_groups"][0]["lr"])
    evaluations = played.decisions * (1 + parameters.learner.update_epochs)
    stats = TrainingStats(played.decisions, evaluations, -played.cost, played.entropy, played.approx_kl, rate)
    return MemberResult(state, policy, stats, validation)


class MissionTrainer(PopulationTraining):
    """A training run in missions; see `PopulationTraining`.

    Parameters
    ----------
    parameters : MissionTrainingParameters, optional
    seed : int
        Seed of all random numbers.
    init : weights, optional
        Initial weights of all members.
    """

    def __init__(
        self, parameters: MissionTrainingParameters | None = None, seed: int = 0, init: Weights | None = None
    ) -> None:
        self.parameters = parameters or MissionTrainingParameters()
        learner = MissionPpo(self.parameters.learner, seed)
        if init is not None:
            learner.network.load_state_dict(init)
        members = [learner.state_dict()] * self.parameters.population
        super().__init__(self.parameters.breeding, seed, members)
        weights = {name: weight.clone() for name, weight in learner.network.state_dict().items()}
        step = STEP if init is None else FINE_STEP
        self.evolution = Evolution(weights, self.parameters.candidates, self.parameters.missions, step)

    def advance(
        self,
        limits: Limits | None = None,
        engine: Engine | None = None,
        should_stop: Callable[[], bool] = never_stop,
    ) -> Report | None:
        """See `PopulationTraining.advance`."""
        began, engine = time.monotonic(), engine or SerialEngine()
        progress, is_evolving = self.progress(limits or Limits()), self.generation < self.parameters.evolved
        results = (self._evolve if is_evolving else self._train)(progress, engine, should_stop)
        return None if results is None else self._conclude(results, began, breeds=not is_evolving)

    def _train(self, progress: float, engine: Engine, should_stop: Callable[[], bool]) -> list[MemberResult] | None:
        """Train and validate all members."""
        jobs = [
            MissionJob(self.parameters, state, self._mixed_seed(member), progress, engine.threads)
            for member, state in enumerate(self.members)
        ]
        return engine.map(train_member, jobs, should_stop)

    def _evolve(self, progress: float, engine: Engine, should_stop: Callable[[], bool]) -> list[MemberResult] | None:
        """Evolve the network for a generation; all members then start from it."""
        parameters = self.parameters
        weights = self.evolution.advance(parameters.curriculum, self._mixed_seed(0), progress, engine, should_stop)
        if weights is None:
            return None
        learner = MissionPpo(parameters.learner)
        learner.network.load_state_dict(weights)
        validation = validate(learner.network, parameters.curriculum.validation(parameters.validations))
        self.members = [learner.state_dict()] * parameters.population
        missions = parameters.candidates * parameters.missions
        stats = TrainingStats(0, missions, validation.reward, 0.0, 0.0, parameters.learner.learning_rate)
        return [MemberResult(self.members[0], weights, stats, validation)]

    def _state(self) -> dict[str, object]:
        return super()._state() | {"evolution": self.evolution.state_dict()}

    def resume(self, path: Path) -> StateDict:
        """See `PopulationTraining.resume`."""
        state = super().resume(path)
        self.evolution.load_state_dict(state["evolution"])
        return state

    def _description(self) -> dict[str, str]:
        parameters, missions = self.parameters, self.parameters.curriculum.missions
        plain = {name: str(value) for name, value in vars(parameters).items() if name != "curriculum"}
        drawn = {name: str(value) for name, value in vars(parameters.curriculum).items() if name != "missions"}
        digests = [hashlib.sha256(repr(mission_to_document(one)).encode()).hexdigest()[:8] for one in missions]
        return {"seed": str(self.seed), "features": FEATURE_SET, **plain, **drawn, "missions": ", ".join(digests)}

    def write_policy(self, path: Path) -> None:
        """See `PopulationTraining.write_policy`."""
        network = MissionNetwork()
        network.load_state_dict(self.best[0])
        save_network(path, network, self.parameters.method, self._figures())
