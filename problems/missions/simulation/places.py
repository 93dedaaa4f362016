"""Where agents and tasks are, and how far apart, by the metric or the table of distances of the instance."""

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
        Three coordinates; None where unknown: 0 away from everywhere.
    nodes : tuple of int
        What a table of distances may call it, best first: the start of agent i is i, task j is n + j.
    """

    position: Position | None
    nodes: tuple[int, ...] = ()


class Distances:
    """How far places of a mission are apart.

    With a table of distances, agents keep to the ways that it gives, so that none is turned round in flight.

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
        """Return the length of the flight from one place to another, ``inf`` where there is none."""
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
        """Return the distance of two positions by the metric alone, 0 where one is unknown (1)."""
        if source is None or goal is None:
            return 0.0
        if self.metric == GEOGRAPHIC:
            return float(geodesic_distances(np.array(source), np.array(goal), self.unit))
        if self.metric == MANHATTAN:
            return sum(abs(a - b) for a, b in zip(source, goal, strict=True))
        return math.dist(source, goal)

    def table(self, sources: list[Position | None], goals: list[Position | None]) -> FloatArray:
        """Return distances by the metric alone, shape (sources, goals)."""
        if not sources or not goals:
            return np.zeros((len(sources), len(goals)))
        by_metric = {
            GEOGRAPHIC: lambda place, goal: geodesic_distances(place, goal, self.unit),
            MANHATTAN: manhattan_distances,
        }
        return distance_table(_array(sources), _array(goals), by_metric.get(self.metric, distances))

    def on_the_way(self, source: Position | None, goal: Position | None, share: float) -> Position | None:
        """Return where an agent is that has flown a share of the way, on a straight line or on a geodesic."""
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
    """Return where each agent begins; a table's row of its start task holds for it where it has no place of its own."""
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
    """Return where each task is."""
    return [Place(position, (instance.n + task,)) for task, position in enumerate(_positions(instance.task_position))]


def _positions(array: FloatArray) -> list[Position | None]:
    return [None if math.isnan(x) else (x, y, z) for x, y, z in array.tolist()]
