"""The trainer: generations of training, validation and breeding.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import uninitialised
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.member import MemberJob, Weights, initial_state, train_member
from alloc.allocators.learned.training.parameters import TrainingParameters, described
from alloc.allocators.learned.training.population import PopulationTraining
from alloc.allocators.learned.training.report import Report
from alloc.allocators.learned.training.validation import validation_boards
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems.game import Board


class Trainer(PopulationTraining):
    """A training run on games; see `PopulationTraining`.

    Parameters
    ----------
    parameters : TrainingParameters, optional
    seed : int
        Seed of all random numbers.
    boards : sequence of Board, optional
        Validation games; those of the curriculum by default.
    init : sequence of weights, optional
        Initial weights of the members' policies, assigned in turn; by default, all members have the same random
        weights, so that the weights of two members can be blended.
    """

    def __init__(
        self,
        parameters: TrainingParameters | None = None,
        seed: int = 0,
        boards: Sequence[Board] | None = None,
        init: Sequence[Weights] = (),
    ) -> None:
        self.parameters = parameters or TrainingParameters()
        self.boards = validation_boards(self.parameters.curriculum) if boards is None else boards
        members = [
            initial_state(self.parameters, seed, init[number % len(init)] if init else None)
            for number in range(self.parameters.population)
        ]
        super().__init__(self.parameters.breeding, seed, members)

    def advance(
        self,
        limits: Limits | None = None,
        engine: Engine | None = None,
        should_stop: Callable[[], bool] = never_stop,
    ) -> Report | None:
        """See `PopulationTraining.advance`."""
        began = time.monotonic()
        engine = engine or SerialEngine()
        jobs = [
            MemberJob(self.parameters, state, self._job(member, limits or Limits()), self.boards, engine.threads)
            for member, state in enumerate(self.members)
        ]
        results = engine.map(train_member, jobs, should_stop)
        return None if results is None else self._conclude(results, began)

    def _job(self, member: int, limits: Limits) -> TrainingJob:
        """Return the next training job of a member, limited to the remaining steps."""
        parameters, decisions = self.parameters, self.parameters.decisions
        if limits.steps is not None:
            left = limits.steps - (self.history[-1].decisions if self.history else 0)
            decisions = max(1, min(decisions, -(-left // parameters.population)))
        seed = self._mixed_seed(member)
        return TrainingJob(seed, decisions, parameters.curriculum, self.progress(limits), parameters.rules)

    def _description(self) -> dict[str, str]:
        return described(self.parameters, self.seed)

    def write_policy(self, path: Path) -> None:
        """See `PopulationTraining.write_policy`."""
        networks = []
        for weights in self.best:
            network = uninitialised(self.parameters.network)
            network.load_state_dict(weights)
            networks.append(network)
        metadata = self._figures() | {
            "turn": str(self.parameters.rules.turn),
            "reward": str(self.parameters.rules.reward),
        }
        save_policy(path, networks, self.parameters.method, metadata)
