"""Places of agents and tasks, and distances by the instance's metric or distance table."""

import math
from dataclasses import dataclass

import numpy as np

from alloc.problems.distances.geodesic import geodesic_distances
from alloc.problems.distances.metric import distance_table, distances, manhattan_distances
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.vocabulary import GEOGRAPHIC, IDLE, MANHATTAN

Position = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a mission.

    Attributes
    ----------
    position : tuple of float, or None
        Three coordinates; None if unknown, with distance 0 from everywhere.
    nodes : tuple of int
        Nodes of the distance table, in order of preference: the start of agent i is i, task j is n + j.
    """

    position: Position | None
    nodes: tuple[int, ...] = ()


class Distances:
    """Distances between places of a mission.

    With a distance table, agents follow its paths to the end and cannot be diverted in flight.

    Parameters
    ----------
    instance : Instance

    Attributes
    ----------
    metric, unit : str
        As in the instance.
    has_table : bool
    """

    def __init__(self, instance: Instance) -> None:
        self.metric, self.unit = instance.metric, instance.distance_unit
        table = instance.distances
        self.has_table = table is not None
        self._missing = math.inf if table is not None and table.missing == "unreachable" else None
        self._given: dict[tuple[int, int], float] = {}
        if table is not None:
            for node, task, there, back in zip(*(part.tolist() for part in table.to_tasks()), strict=True):
                self._given[node, instance.n + task] = there
                self._given[instance.n + task, node] = back

    def between(self, source: Place, goal: Place) -> float:
        """Return the length of the flight from one place to another, ``inf`` if there is no path."""
        for node in source.nodes if self.has_table else ():
            for other in goal.nodes:
                if node == other:
                    return 0.0
                if (node, other) in self._given:
                    return self._given[node, other]
        if self._missing is not None:
            return self._missing
        return self.by_metric(source.position, goal.position)

    def by_metric(self, source: Position | None, goal: Position | None) -> float:
        """Return the distance of two positions by the metric (1), 0 if one is unknown."""
        if source is None or goal is None:
            return 0.0
        if self.metric == GEOGRAPHIC:
            return float(geodesic_distances(np.array(source), np.array(goal), self.unit))
        if self.metric == MANHATTAN:
            return sum(abs(a - b) for a, b in zip(source, goal, strict=True))
        return math.dist(source, goal)

    def table(self, sources: list[Position | None], goals: list[Position | None]) -> FloatArray:
        """Return distances by the metric, shape (sources, goals)."""
        if not sources or not goals:
            return np.zeros((len(sources), len(goals)))
        by_metric = {
            GEOGRAPHIC: lambda place, goal: geodesic_distances(place, goal, self.unit),
            MANHATTAN: manhattan_distances,
        }
        return distance_table(_array(sources), _array(goals), by_metric.get(self.metric, distances))

    def on_the_way(self, source: Position | None, goal: Position | None, share: float) -> Position | None:
        """Return the position after a share of a flight, on a straight line or a geodesic."""
        if source is None or goal is None:
            return source
        if self.metric == GEOGRAPHIC:
            return _on_geodesic(source, goal, share)
        (x, y, z), (to_x, to_y, to_z) = source, goal
        return x + share * (to_x - x), y + share * (to_y - y), z + share * (to_z - z)


def _array(positions: list[Position | None]) -> FloatArray:
    return np.array([(math.nan,) * 3 if position is None else position for position in positions])


def _on_geodesic(source: Position, goal: Position, share: float) -> Position:
    from pyproj import Geod

    ellipsoid = Geod(ellps="WGS84")
    azimuth, _, metres = ellipsoid.inv(source[0], source[1], goal[0], goal[1])
    longitude, latitude, _ = ellipsoid.fwd(source[0], source[1], azimuth, share * metres)
    return float(longitude), float(latitude), source[2] + share * (goal[2] - source[2])


def starting_places(instance: Instance) -> list[Place]:
    """Return the start of each agent; where an agent has no node of its own, that of its start task applies."""
    unknown = np.isnan(instance.agent_position[:, 0])
    starts = np.where(unknown, instance.start_task, IDLE).tolist()
    positions = _positions(instance.start_position)
    return [
        Place(position, (agent,) if start == IDLE else (agent, instance.n + start))
        for agent, (position, start) in enumerate(zip(positions, starts, strict=True))
    ]


def bases_of_agents(instance: Instance) -> list[Place | None]:
    """Return the base of each agent that returns to one, None for the others."""
    places = [Place(position) for position in _positions(instance.bases.position)]
    return [places[base] if base >= 0 else None for base in instance.return_base.tolist()]


def task_places(instance: Instance) -> list[Place]:
    """Return the place of each task."""
    return [Place(position, (instance.n + task,)) for task, position in enumerate(_positions(instance.task_position))]


def _positions(array: FloatArray) -> list[Position | None]:
    return [None if math.isnan(x) else (x, y, z) for x, y, z in array.tolist()]
