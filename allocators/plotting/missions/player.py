"""A self-contained interactive page that plays a mission; a browser opens it from disk without a network."""

import base64
import json
import math
import re
from html import escape
from importlib.resources import files

import numpy as np

from alloc.allocators.plotting.missions.map import Plane, agent_colours, plane_of, track
from alloc.allocators.plotting.missions.picture import title
from alloc.allocators.plotting.missions.states import AGENT_COLOURS, TASK_COLOURS, doing
from alloc.problems.formats import write_text_atomically
from alloc.problems.missions.course import Awareness, Course
from alloc.problems.missions.simulation.places import Position
from alloc.problems.missions.simulation.state import AgentStatus
from alloc.problems.text import one_line
from alloc.problems.vocabulary import Knowledge

MAX_MESSAGES = 60_000
"""Maximum number of messages on the page; of more, every k-th is kept."""

STEPS = 65_534
"""Number of steps for quantising the hours of reports, as integers from 1 to this number plus 1; 0 is unknown."""

Entry = dict[str, object]


def write_player(course: Course, path: str) -> None:
    """Write the page.

    Parameters
    ----------
    course : Course
    path : str
        An .html file.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    write_text_atomically(path, to_html(course))


def to_html(course: Course) -> str:
    """Return the page, made from the templates beside this module with the mission as JSON."""
    data = json.dumps(document(course), allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
    parts = {"TITLE": escape(one_line(course.mission.name)), "MISSION": data, "LIBRARY": _text_of("d3.min.js")}
    parts |= {"STYLE": _text_of("player.css"), "SCRIPT": _text_of("player.js")}
    return re.sub(r"\$(TITLE|MISSION|LIBRARY|STYLE|SCRIPT)", lambda mark: parts[mark[1]], _text_of("player.html"))


def _text_of(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")


def document(course: Course) -> Entry:
    """Return the content of the page: positions on the map, hours, and states as indices."""
    instance, plane = course.mission.instance, plane_of(course.mission.instance)
    every = -(-len(course.messages) // MAX_MESSAGES) or 1
    sensing, radius = course.mission.sensing, course.mission.radio.radius
    return {
        "summary": title(course).replace("\\$", "$").split("\n"),
        "end": course.end,
        "unit": instance.units.time,
        "axes": plane.where.axes,
        "aspect": plane.where.aspect,
        "window": _window(course, plane),
        "agents": _agents(course, plane),
        "tasks": _tasks(course, plane),
        "agentStates": _shown(AGENT_COLOURS),
        "taskStates": _shown(TASK_COLOURS),
        "messages": [[_rounded(hour), agent, heard] for hour, agent, heard in course.messages[::every]],
        "isFull": course.result.knowledge == Knowledge.FULL,
        "sensing": sensing if math.isfinite(sensing) else None,
        "radius": radius if math.isfinite(radius) else None,
        "knowledge": None if course.awareness is None else _knowledge(course.awareness, course.end),
    }


def _shown(colours: dict[str, str]) -> list[Entry]:
    return [{"name": name, "colour": colour} for name, colour in colours.items()]


def _window(course: Course, plane: Plane) -> list[list[float]] | None:
    if plane.is_empty:
        return None
    low, high = plane.window(np.vstack([np.empty((0, 2)), *(track(course, i, plane) for i in range(len(course.legs)))]))
    return [low.tolist(), high.tolist()]


def _point(plane: Plane, position: Position | None) -> list[float] | None:
    x, y = plane.point(position)
    return None if math.isnan(x) else [_rounded(x), _rounded(y)]


def _rounded(value: float) -> float:
    return float(f"{value:.7g}")


def _agents(course: Course, plane: Plane) -> list[Entry]:
    names, colours = list(AGENT_COLOURS), agent_colours(len(course.legs))
    return [
        {
            "id": one_line(name),
            "colour": colour,
            "legs": [
                [
                    _rounded(leg.begin),
                    _rounded(leg.end),
                    _point(plane, leg.source),
                    _point(plane, leg.goal),
                    -1 if (state := doing(leg)) is None else names.index(state),
                    leg.task,
                ]
                for leg in legs
                if leg.status is not AgentStatus.ABSENT
            ],
        }
        for name, colour, legs in zip(course.mission.instance.agent_ids, colours, course.legs, strict=True)
    ]


def _tasks(course: Course, plane: Plane) -> list[Entry]:
    ids, places, deadlines = (
        course.mission.instance.task_ids,
        plane.where.tasks.tolist(),
        course.mission.deadline.tolist(),
    )
    rows = zip(ids, places, deadlines, course.levels, strict=True)
    return [
        {
            "id": one_line(name),
            "place": None if np.isnan(place[0]) else [_rounded(axis) for axis in place],
            "deadline": None if math.isinf(deadline) else deadline,
            "levels": [[_rounded(level.hour), _rounded(level.left), str(level.status)] for level in levels],
        }
        for name, place, deadline, levels in rows
    ]


def _knowledge(awareness: Awareness, end: float) -> Entry:
    """Return the hours of reports as two-byte integers, row by row, in base64."""
    known = ~np.isnan(awareness.reports)
    steps = np.zeros(awareness.reports.shape, dtype="<u2")
    steps[known] = 1 + np.round(awareness.reports[known] / (end or 1.0) * STEPS).clip(0, STEPS)
    return {
        "agents": list(awareness.agents),
        "hours": [_rounded(hour) for hour in awareness.hours.tolist()],
        "steps": STEPS,
        "reports": base64.b64encode(steps.tobytes()).decode("ascii"),
    }
