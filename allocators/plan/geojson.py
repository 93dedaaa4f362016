"""A plan as GeoJSON (RFC 7946): points for tasks, agents and bases, and lines for moves and returns to bases."""

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.table import AgentRow, TaskRow, agent_rows, task_rows
from alloc.problems.formats import json_text

if TYPE_CHECKING:
    from alloc.allocators.result import Result

Position = list[float]
Feature = dict[str, object]
Properties = AgentRow | TaskRow | dict[str, str]


def to_geojson(result: "Result") -> str:
    """Return a plan as a GeoJSON feature collection; the property `kind` is task, agent, base, move or return."""
    instance = result.instance
    tasks = dict(zip(instance.task_ids, instance.task_position.tolist(), strict=True))
    starts = dict(zip(instance.agent_ids, instance.start_position.tolist(), strict=True))
    features: list[Feature] = []
    agents = agent_rows(result)
    for task in task_rows(result):
        features += _point("task", task, tasks[task.task])
    for agent in agents:
        features += _point("agent", agent, starts[agent.agent])
    for agent in agents:
        if agent.task is not None and not agent.violation:
            features += _line("move", agent, starts[agent.agent], tasks[agent.task])
    bases = dict(zip(instance.bases.ids, instance.bases.position.tolist(), strict=True))
    for name, place in bases.items():
        features += _point("base", {"base": name}, place)
    for agent in agents:
        base = int(instance.return_base[instance.agent_index[agent.agent]])
        if agent.task is not None and not agent.violation and base >= 0:
            features += _line("return", agent, tasks[agent.task], bases[instance.bases.ids[base]])
    units = {name: label for name, label in asdict(instance.units).items() if label}
    document: dict[str, object] = {"type": "FeatureCollection", "name": instance.name, "units": units}
    return json_text.lines({**document, "features": features})


def _point(kind: str, row: Properties, place: Position) -> list[Feature]:
    """Return a point feature, or no feature if the position is unknown."""
    if np.isnan(place[0]):
        return []
    return [_feature(kind, row, {"type": "Point", "coordinates": _position(place)})]


def _line(kind: str, row: AgentRow, start: Position, goal: Position) -> list[Feature]:
    """Return a line feature, in two parts if it crosses the date line; none if an end is unknown or both are equal."""
    if np.isnan(start[0]) or np.isnan(goal[0]) or start == goal:
        return []
    first, second = _position(start), _position(goal)
    if abs(goal[0] - start[0]) <= 180:
        return [_feature(kind, row, {"type": "LineString", "coordinates": [first, second]})]
    edge = 180.0 if start[0] > 0 else -180.0
    before, after = abs(edge - start[0]), abs(edge + goal[0])
    share = before / (before + after) if before + after else 0.5
    latitude = start[1] + share * (goal[1] - start[1])
    parts = [[first, [edge, latitude]], [[-edge, latitude], second]]
    return [_feature(kind, row, {"type": "MultiLineString", "coordinates": parts})]


def _position(place: Position) -> Position:
    """Return longitude, latitude and, unless it is 0, altitude."""
    return place if place[2] else place[:2]


def _feature(kind: str, row: Properties, geometry: dict[str, object]) -> Feature:
    properties = row if isinstance(row, dict) else asdict(row)
    return {"type": "Feature", "geometry": geometry, "properties": {"kind": kind, **properties}}
