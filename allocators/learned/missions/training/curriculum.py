"""Training missions of many families, sizes, radii and losses, which become more varied in the course of training."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from alloc.allocators.missions.layout import MissionArrays
from alloc.allocators.missions.pack import pack
from alloc.problems.missions.families.draw import random_mission
from alloc.problems.missions.families.parameters import MissionParameters
from alloc.problems.missions.mission import Mission
from alloc.problems.vocabulary import MissionFamily

FAMILIES = tuple(str(family) for family in MissionFamily if not str(family).startswith("paper"))
"""Families of training missions."""

VALIDATION_SEED = 1_000_000_000
"""First seed of validation missions."""

VALIDATION_SIZES = ((20, 40), (40, 80), (10, 40), (60, 40))
"""Numbers of agents and tasks of validation missions, used in turn."""


class PackedMission(NamedTuple):
    """A mission prepared for compiled runs.

    Attributes
    ----------
    arrays : MissionArrays
    ideal : float
        Ideal mission time: hours that all agents together would need for all work if flights took no time.
    periods : int
        Number of radio periods per message, see `should_send`.
    """

    arrays: MissionArrays
    ideal: float
    periods: int = 1


@dataclass(frozen=True)
class MissionCurriculum:
    """Draws missions for training.

    Attributes
    ----------
    families : tuple of str
        Families of `MissionFamily` to draw from.
    agents, tasks : tuple of int
        Minimum and maximum numbers of agents and tasks.
    radii : tuple of float
        Values from which radio radius and sensing radius are drawn independently.
    losses : tuple of float
        Shares of lost messages to draw from.
    periods : tuple of int
        Numbers of radio periods per message.
    varied_from : float
        Share of the training after which everything varies; before, only missions of the first family, radius and loss
        are drawn.
    missions : tuple of Mission
        Training missions in place of drawn ones, if there are any.
    """

    families: tuple[str, ...] = FAMILIES
    agents: tuple[int, int] = (10, 60)
    tasks: tuple[int, int] = (20, 80)
    radii: tuple[float, ...] = (0.3, 0.3, 0.2, 0.15)
    losses: tuple[float, ...] = (0.2, 0.0, 0.8)
    periods: tuple[int, ...] = (1, 10)
    varied_from: float = 0.1
    missions: tuple[Mission, ...] = field(default=())

    def draw(self, rng: np.random.Generator, count: int, progress: float) -> list[tuple[PackedMission, int]]:
        """Return missions and the seeds of their runs.

        Parameters
        ----------
        rng : Generator
        count : int
        progress : float
            Share of the training that is done, 0 to 1.
        """
        drawn = []
        for _ in range(count):
            seed = int(rng.integers(0, VALIDATION_SEED))
            periods = int(rng.choice(self.periods))
            if self.missions:
                mission = packed(self.missions[int(rng.integers(len(self.missions)))])
            else:
                mission = _generated(self._parameters(rng, progress), seed)
            drawn.append((mission._replace(periods=periods), seed))
        return drawn

    def _parameters(self, rng: np.random.Generator, progress: float) -> MissionParameters:
        n = int(rng.integers(self.agents[0], self.agents[1] + 1))
        m = int(rng.integers(self.tasks[0], self.tasks[1] + 1))
        if progress < self.varied_from:
            radius = self.radii[0]
            return MissionParameters(self.families[0], n, m, radius=radius, sensing=radius, loss=self.losses[0])
        family, loss = str(rng.choice(self.families)), float(rng.choice(self.losses))
        radius, sensing = (float(value) for value in rng.choice(self.radii, 2))
        return MissionParameters(family, n, m, radius=radius, sensing=sensing, loss=loss)

    def validation(self, count: int) -> list[tuple[PackedMission, int]]:
        """Return missions that training never draws, of each family in turn, and the seeds of their runs."""
        seeds = range(VALIDATION_SEED, VALIDATION_SEED + count)
        kinds = len(self.missions or self.families)
        chosen = []
        for k, seed in enumerate(seeds):
            if self.missions:
                mission = packed(self.missions[k % kinds])
            else:
                n, m = VALIDATION_SIZES[k // kinds % len(VALIDATION_SIZES)]
                mission = _generated(MissionParameters(self.families[k % kinds], n, m), seed)
            turn = k // kinds + k // (kinds * len(VALIDATION_SIZES))  # each size with each of them
            chosen.append((mission._replace(periods=self.periods[turn % len(self.periods)]), seed))
        return chosen


@lru_cache(maxsize=256)
def _generated(parameters: MissionParameters, seed: int) -> PackedMission:
    return packed(random_mission(parameters, seed))


def packed(mission: Mission) -> PackedMission:
    """Return a mission prepared for compiled runs."""
    instance = mission.instance
    ideal = float(instance.workload.sum() / instance.ability.sum())
    return PackedMission(pack(mission), max(ideal, 1e-9))
