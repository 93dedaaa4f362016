"""The course of a mission, for plots: trajectories of agents, work left of tasks, messages and knowledge over time."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from alloc.problems.instance import FloatArray
from alloc.problems.missions.mission import Mission
from alloc.problems.missions.simulation.measures import MissionResult
from alloc.problems.missions.simulation.places import Position
from alloc.problems.missions.simulation.state import AgentStatus, TaskStatus


@dataclass(slots=True)
class Leg:
    """An activity of one agent between two hours, with uniform straight motion between two positions.

    Attributes
    ----------
    begin, end : float
        Hours.
    status : AgentStatus
    source, goal : tuple of float, or None
        Positions at both; None if unknown.
    task : int
        Index of the task to which it flew or at which it worked; -1 for none.
    """

    begin: float
    end: float
    status: AgentStatus
    source: Position | None
    goal: Position | None
    task: int = -1

    def position(self, hour: float) -> Position | None:
        """Return the agent's position at an hour between the two."""
        if self.source is None or self.goal is None or self.end <= self.begin:
            return self.source
        share = min(1.0, max(0.0, (hour - self.begin) / (self.end - self.begin)))
        x, y, z = (a + share * (b - a) for a, b in zip(self.source, self.goal, strict=True))
        return x, y, z


@dataclass(frozen=True, slots=True)
class Level:
    """Work left and status of one task from an hour on; work left is linear between two levels.

    A jump, such as a cancellation, is two levels at the same hour.
    """

    hour: float
    left: float
    status: TaskStatus


@dataclass(frozen=True, eq=False)
class Awareness:
    """Hours of the reports that agents had at some moments.

    Attributes
    ----------
    agents : tuple of int
        Agents whose knowledge was recorded.
    hours : ndarray, shape (k,)
        The moments.
    reports : ndarray, shape (len(agents), k, n + m)
        Hour of the last report of each agent and each task; NaN if there was none.
    """

    agents: tuple[int, ...]
    hours: FloatArray
    reports: FloatArray


@dataclass(frozen=True, eq=False)
class Course:
    """The course of a finished mission, for plots.

    Attributes
    ----------
    mission : Mission
    result : MissionResult
    end : float
        Hour at which it ended.
    legs : tuple of list of Leg
        Legs of each agent, in chronological order.
    levels : tuple of list of Level
        Levels of each task, in chronological order.
    messages : tuple of (float, int, int)
        Hour, sender, and number of receivers.
    awareness : Awareness or None
        None with full knowledge, or if it was not recorded, as in courses made from a log.
    """

    mission: Mission
    result: MissionResult
    end: float
    legs: tuple[list[Leg], ...]
    levels: tuple[list[Level], ...]
    messages: tuple[tuple[float, int, int], ...]
    awareness: Awareness | None = None

    def statuses(self, hours: FloatArray) -> list[list[TaskStatus]]:
        """Return the status of each task at the given hours, in ascending order."""
        return [[level.status for level in _at(levels, hours)] for levels in self.levels]

    def work_left(self, hours: FloatArray) -> FloatArray:
        """Return the work left of each task at the given hours, shape (m, hours)."""
        left = np.zeros((len(self.levels), len(hours)))
        for row, levels in zip(left, self.levels, strict=True):
            last = {level.hour: level.left for level in levels}  # the later one of two at the same hour
            known = np.array([level.hour for level in levels])
            amount = np.array([level.left for level in levels])
            after = np.searchsorted(known, hours, side="right")
            for column, (hour, index) in enumerate(zip(hours.tolist(), after.tolist(), strict=True)):
                row[column] = last.get(hour, _between(known, amount, hour, index))
        return left

    def leg(self, agent: int, hour: float) -> Leg | None:
        """Return the leg of an agent at an hour; None before it joined, or after it failed."""
        found = None
        for leg in self.legs[agent]:
            if leg.begin > hour:
                break
            found = leg
        return found


def _at(levels: list[Level], hours: FloatArray) -> Iterator[Level]:
    known = np.array([level.hour for level in levels])
    for index in np.searchsorted(known, hours, side="right").tolist():
        yield levels[max(index - 1, 0)]


def _between(known: FloatArray, amount: FloatArray, hour: float, after: int) -> float:
    if after == 0 or after == len(known):
        return float(amount[min(after, len(known) - 1)])
    begin, end = float(known[after - 1]), float(known[after])
    share = (hour - begin) / (end - begin) if end > begin else 1.0
    return float(amount[after - 1] + share * (amount[after] - amount[after - 1])) if math.isfinite(share) else 0.0
