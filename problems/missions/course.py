"""The course of a mission: where everybody was, what was left of each task, and who knew of what since when."""

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
    """What one agent did between two hours; it went straight from one position to the other, at one speed.

    Attributes
    ----------
    begin, end : float
        Hours.
    status : AgentStatus
    source, goal : tuple of float, or None
        Where it was at both; None where unknown.
    task : int
        Where it flew or worked; -1 for none.
    """

    begin: float
    end: float
    status: AgentStatus
    source: Position | None
    goal: Position | None
    task: int = -1

    def position(self, hour: float) -> Position | None:
        """Return where the agent was at an hour between the two."""
        if self.source is None or self.goal is None or self.end <= self.begin:
            return self.source
        share = min(1.0, max(0.0, (hour - self.begin) / (self.end - self.begin)))
        x, y, z = (a + share * (b - a) for a, b in zip(self.source, self.goal, strict=True))
        return x, y, z


@dataclass(frozen=True, slots=True)
class Level:
    """Work left of one task, and its status, from an hour on; between two of them work left is linear.

    A change at once, such as a task that is cancelled, has two at the same hour.
    """

    hour: float
    left: float
    status: TaskStatus


@dataclass(frozen=True, eq=False)
class Awareness:
    """Who knew of what, at some moments: all that is known of an agent or a task was true at an hour that is kept.

    Attributes
    ----------
    agents : tuple of int
        Whose knowledge was recorded.
    hours : ndarray, shape (k,)
        The moments.
    reports : ndarray, shape (len(agents), k, n + m)
        Hour of the last report of each agent, and of each task; NaN where nothing was known.
    """

    agents: tuple[int, ...]
    hours: FloatArray
    reports: FloatArray


@dataclass(frozen=True, eq=False)
class Course:
    """A mission that is over, to be drawn.

    Attributes
    ----------
    mission : Mission
    result : MissionResult
    end : float
        Hour at which it ended.
    legs : tuple of list of Leg
        Of each agent, in the order of time.
    levels : tuple of list of Level
        Of each task, in the order of time.
    messages : tuple of (float, int, int)
        Hour, agent, and number of agents that heard it.
    awareness : Awareness or None
        None where all know all, or where it was not recorded: a log does not hold it.
    """

    mission: Mission
    result: MissionResult
    end: float
    legs: tuple[list[Leg], ...]
    levels: tuple[list[Level], ...]
    messages: tuple[tuple[float, int, int], ...]
    awareness: Awareness | None = None

    def statuses(self, hours: FloatArray) -> list[list[TaskStatus]]:
        """Return the status of each task at some hours, which ascend."""
        return [[level.status for level in _at(levels, hours)] for levels in self.levels]

    def work_left(self, hours: FloatArray) -> FloatArray:
        """Return the work left of each task at some hours, shape (m, hours)."""
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
        """Return what an agent did at an hour; None before it joined, or after it failed."""
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
