"""The steps between generations of any population: rank, keep the best, breed, and save the run."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from alloc.allocators.learned.algorithms.gappo import breed, fitness
from alloc.allocators.learned.algorithms.hyperparameters import BreedingParameters
from alloc.allocators.learned.files.checkpoint import read_checkpoint, write_checkpoint
from alloc.allocators.learned.network.state_dict import StateDict
from alloc.allocators.learned.training.limits import Limits
from alloc.allocators.learned.training.member import MemberResult, Weights
from alloc.allocators.learned.training.report import Report, best_generation, next_report
from alloc.allocators.parallel.engine import Engine, never_stop


class PopulationTraining(ABC):
    """A training run of a population, which can be stopped at any time and resumed with the same learning curve.

    Parameters
    ----------
    breeding : BreedingParameters
    seed : int
        Seed of all random numbers.
    members : list of StateDict
        States of the learners.

    Attributes
    ----------
    members : list of StateDict
    history : list of Report
        One report per generation.
    best : list of weights
        The networks of the generation with the lowest cost, best first.
    """

    def __init__(self, breeding: BreedingParameters, seed: int, members: list[StateDict]) -> None:
        self.seed, self.members = seed, members
        self.history: list[Report] = []
        self.best: list[Weights] = []
        self._breeding = breeding

    @property
    def generation(self) -> int:
        """Number of complete generations."""
        return len(self.history)

    @property
    def best_generation(self) -> int:
        """The generation with the best networks, from 1; 0 before the first."""
        return best_generation(self.history)

    def progress(self, limits: Limits) -> float:
        """Return the share of the training that is done; see `Limits.progress`."""
        return limits.progress(self.history)

    def is_over(self, limits: Limits) -> bool:
        """Return whether a limit is reached."""
        return limits.reached(self.history)

    @abstractmethod
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
            Limits of the whole run, on which schedules depend.
        engine : Engine, optional
            Engine that trains the members; by default one after another in this process.
        should_stop : callable
            As for `Engine.map`.

        Returns
        -------
        Report or None
            None if `should_stop` returned True before the generation was complete; nothing has changed then.
        """

    def _conclude(self, results: Sequence[MemberResult], began: float, *, breeds: bool = True) -> Report:
        """Record a generation that began at `began` (`time.monotonic`), and breed the next one if `breeds`."""
        scores = self._fitness(results)
        ranking = sorted(range(len(results)), key=lambda member: results[member].validation.cost)
        report = next_report(self.history, results, ranking[0], max(scores), time.monotonic() - began)
        if not self.history or report.cost < self.history[-1].best_cost:
            self.best = [results[member].policy for member in ranking]
        self.history.append(report)
        if breeds:
            self.members = [one.state for one in results]
            if len(self.members) > 1:
                self.members = breed(self.members, scores, self._breeding, self._mixed_seed(len(self.members)))
        return report

    def _fitness(self, results: Sequence[MemberResult]) -> list[float]:
        """Return the fitness (12) of all members."""
        return fitness(
            [one.validation.reward for one in results],
            [one.stats.entropy for one in results],
            [one.stats.evaluations for one in results],
            self._breeding,
        )

    def _mixed_seed(self, number: int) -> int:
        """Return a seed derived from that of the run, the generation and a number."""
        mixed = np.random.SeedSequence((self.seed, self.generation, number)).generate_state(1, np.uint64)
        return int(mixed[0] >> np.uint64(1))

    @abstractmethod
    def _description(self) -> dict[str, str]:
        """Return everything that determines the learning curve, as text."""

    def _state(self) -> dict[str, object]:
        """Return the content of a checkpoint."""
        return {
            "members": self.members,
            "history": [asdict(report) for report in self.history],
            "best": self.best,
        }

    def save(self, path: Path) -> None:
        """Write a checkpoint of the whole run, from which `resume` continues as if there was no interruption."""
        write_checkpoint(path, self._description(), self._state())

    def resume(self, path: Path) -> StateDict:
        """Restore the run from a checkpoint, and return the checkpoint's content.

        Raises
        ------
        InputError
            If there is no checkpoint of this version at `path`, or it has another method, seed or parameters.
        """
        state = read_checkpoint(path, self._description())
        self.members, self.best = state["members"], state["best"]
        self.history = [Report(**report) for report in state["history"]]
        return state

    @abstractmethod
    def write_policy(self, path: Path) -> None:
        """Write the best networks so far to a policy file."""

    def _figures(self) -> dict[str, str | float]:
        """Return the figures of the best generation for the metadata of a policy file."""
        report = self.history[self.best_generation - 1]
        return {
            "seed": self.seed,
            "generation": report.generation,
            "decisions": report.decisions,
            "validation_time": round(report.time, 6),
            "validation_distance": round(report.distance, 6),
        }
