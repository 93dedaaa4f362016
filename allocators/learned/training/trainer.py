"""The trainer: generations of training, validation and breeding.

References
----------
Fang et al. (2025), Algorithm 1, doi:10.20944/preprints202502.0192.v1.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from alloc.allocators.learned.algorithms.gappo import breed, fitness
from alloc.allocators.learned.algorithms.learner import TrainingJob
from alloc.allocators.learned.files.checkpoint import read_checkpoint, write_checkpoint
from alloc.allocators.learned.files.policy_file import save_policy
from alloc.allocators.learned.network.actor_critic import unfilled
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.member import MemberJob, MemberResult, Weights, initial_state, train_member
from alloc.allocators.learned.training.parameters import TrainingParameters, described
from alloc.allocators.learned.training.report import Report, best_generation, next_report
from alloc.allocators.learned.training.validation import validation_boards
from alloc.allocators.parallel.engine import Engine, never_stop
from alloc.allocators.parallel.serial import SerialEngine
from alloc.problems.game import Board


class Trainer:
    """A training run that can be stopped at any moment and resumed to the same learning curve.

    Parameters
    ----------
    parameters : TrainingParameters, optional
    seed : int
        Seed of all random numbers.
    boards : sequence of Board, optional
        Validation games; those of the curriculum by default.
    init : sequence of weights, optional
        Initial weights of the members' policies, assigned in turn; by default all members have the same random
        weights, so that those of two members can be blended.

    Attributes
    ----------
    members : list of StateDict
        States of the learners.
    history : list of Report
        One report per generation.
    best : list of weights
        The networks of the generation with the lowest cost, the best first.
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
        self.members = [
            initial_state(self.parameters, seed, init[number % len(init)] if init else None)
            for number in range(self.parameters.population)
        ]
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
        """Train, validate and breed one generation.

        Parameters
        ----------
        limits : Limits, optional
            Limits of the whole run, which its schedules follow.
        engine : Engine, optional
            Where the members are trained; one after the other in this process by default.
        should_stop : callable
            As for `Engine.map`.

        Returns
        -------
        Report or None
            None if `should_stop` returned True before the generation was complete; nothing is changed then.
        """
        began = time.monotonic()
        engine = engine or SerialEngine()
        jobs = [
            MemberJob(self.parameters, state, self._job(member, limits or Limits()), self.boards, engine.threads)
            for member, state in enumerate(self.members)
        ]
        results = engine.map(train_member, jobs, should_stop)
        if results is None:
            return None
        scores = self._fitness(results)
        ranking = sorted(range(len(results)), key=lambda member: results[member].validation.cost)
        report = next_report(self.history, results, ranking[0], max(scores), time.monotonic() - began)
        if not self.history or report.cost < self.history[-1].best_cost:
            self.best = [results[member].policy for member in ranking]
        self.history.append(report)
        self.members = [one.state for one in results]
        if len(self.members) > 1:
            seed = _mixed_seed(self.seed, self.generation, len(self.members))
            self.members = breed(self.members, scores, self.parameters.breeding, seed)
        return report

    def _fitness(self, results: Sequence[MemberResult]) -> list[float]:
        """Return the fitness (12) of all members."""
        return fitness(
            [one.validation.reward for one in results],
            [one.stats.entropy for one in results],
            [one.stats.evaluations for one in results],
            self.parameters.breeding,
        )

    def _job(self, member: int, limits: Limits) -> TrainingJob:
        """Return the next training job of a member, the last ones cut to the steps that are left."""
        parameters, decisions = self.parameters, self.parameters.decisions
        if limits.steps is not None:
            left = limits.steps - (self.history[-1].decisions if self.history else 0)
            decisions = max(1, min(decisions, -(-left // parameters.population)))
        seed = _mixed_seed(self.seed, self.generation, member)
        return TrainingJob(seed, decisions, parameters.curriculum, self.progress(limits), parameters.rules)

    def save(self, path: Path) -> None:
        """Write a checkpoint of the whole run, from which `resume` continues as without a break."""
        state = {
            "members": self.members,
            "history": [asdict(report) for report in self.history],
            "best": self.best,
        }
        write_checkpoint(path, described(self.parameters, self.seed), state)

    def resume(self, path: Path) -> None:
        """Restore the run of a checkpoint.

        Raises
        ------
        InputError
            If there is no checkpoint of this version at `path`, or it is one of another method, seed or parameters.
        """
        state = read_checkpoint(path, described(self.parameters, self.seed))
        self.members, self.best = state["members"], state["best"]
        self.history = [Report(**report) for report in state["history"]]

    def write_policy(self, path: Path) -> None:
        """Write the best networks up to now to a policy file."""
        networks = []
        for weights in self.best:
            network = unfilled(self.parameters.network)
            network.load_state_dict(weights)
            networks.append(network)
        report = self.history[self.best_generation - 1]
        metadata: dict[str, str | float] = {
            "seed": self.seed,
            "generation": report.generation,
            "decisions": report.decisions,
            "validation_time": round(report.time, 6),
            "validation_distance": round(report.distance, 6),
            "turn": str(self.parameters.rules.turn),
            "reward": str(self.parameters.rules.reward),
        }
        save_policy(path, networks, self.parameters.method, metadata)


def _mixed_seed(*numbers: int) -> int:
    """Return the seed of a generator, mixed from several numbers."""
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> np.uint64(1))
