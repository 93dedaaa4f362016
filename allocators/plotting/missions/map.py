"""The map of a mission: its plane, the tasks, and the tracks of agents."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.palette import SERIES
from alloc.allocators.plan.places import Places, places, two_axes
from alloc.allocators.plotting.colours import MOVE
from alloc.allocators.plotting.labels import place_labels
from alloc.allocators.plotting.missions.states import CANCELLED, DONE, MISSED, TASK_COLOURS, task_states
from alloc.allocators.plotting.sites import plain_text
from alloc.problems.instance import FloatArray, Instance
from alloc.problems.missions.course import Course
from alloc.problems.missions.simulation.places import Position
from alloc.problems.missions.simulation.state import AgentStatus
from alloc.problems.text import short_names
from alloc.problems.vocabulary import GEOGRAPHIC

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

MAX_NAMES = 40
"""Number of tasks above which none is labelled."""

MARKS = {DONE: "o", MISSED: "X", CANCELLED: "s"}
"""Markers of tasks that are done, missed or cancelled; open ones are hollow circles."""

FAILED = "x"
"""Marker of agents that have failed."""

MARGIN = 0.06
"""Margin around all positions, as a share of the longer side of the drawing."""


@dataclass(frozen=True, eq=False)
class Plane:
    """The plane of a map.

    Attributes
    ----------
    where : Places
        Positions of all tasks and of the starts of agents.
    axes : (int, int)
        The two coordinates of a position that are drawn.
    wraps : bool
        Whether longitudes range from 0 to 360 degrees, as the mission lies around the date line.
    """

    where: Places
    axes: tuple[int, int]
    wraps: bool

    def point(self, position: Position | None) -> tuple[float, float]:
        """Return the coordinates at which a position is drawn, NaN if it is unknown."""
        if position is None:
            return np.nan, np.nan
        x, y = position[self.axes[0]], position[self.axes[1]]
        return (x % 360 if self.wraps else x), y

    @property
    def is_empty(self) -> bool:
        """Whether all positions are unknown."""
        return bool(np.isnan(self.where.tasks[:, 0]).all() and np.isnan(self.where.starts[:, 0]).all())

    def window(self, more: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the lower left and upper right corner of a drawing of all positions and `more`, shape (k, 2)."""
        known = np.vstack([self.where.tasks, self.where.starts, more])
        known = known[~np.isnan(known[:, 0])]
        low, high = known.min(axis=0), known.max(axis=0)
        scale = np.array([1.0, self.where.aspect])
        room = MARGIN * (float(((high - low) * scale).max()) or 1.0) / scale
        return low - room, high + room


def plane_of(instance: Instance) -> Plane:
    """Return the plane on which an instance is drawn."""
    where = places(instance)
    if instance.metric != GEOGRAPHIC:
        return Plane(where, two_axes(instance), False)
    both = np.concatenate([where.tasks[:, 0], where.starts[:, 0]])
    return Plane(where, (0, 1), bool((both > 180).any()))


def track(course: Course, agent: int, plane: Plane) -> FloatArray:
    """Return the vertices of an agent's track, shape (k, 2); unknown ones are rows of NaN."""
    legs = course.legs[agent]
    corners = [plane.point(leg.source) for leg in legs]
    corners += [plane.point(legs[-1].goal)] if legs else []
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def agent_colours(n: int) -> list[str]:
    """Return the colour of each agent: distinct ones if there are few agents, else the same."""
    return list(SERIES[:n]) if n <= len(SERIES) else [MOVE] * n


def task_areas(course: Course) -> FloatArray:
    """Return the area of each task's marker in square points, proportional to the most work that it ever had left."""
    most = np.array([max(level.left for level in levels) for levels in course.levels])
    largest = float(np.clip(9_000 / max(len(most), 1), 30, 420))
    return np.maximum(12.0, largest * most / (float(most.max(initial=0.0)) or 1.0))


def prepare(axes: "Axes", course: Course, plane: Plane) -> None:
    """Set the limits, aspect and labels of a map."""
    corners = [track(course, agent, plane) for agent in range(len(course.legs))]
    low, high = plane.window(np.vstack(corners) if corners else np.empty((0, 2)))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=plain_text(plane.where.axes[0]))
    axes.set_ylabel(plain_text(plane.where.axes[1]))
    axes.set_aspect(plane.where.aspect, adjustable="box")
    axes.grid(color="0.93", linewidth=0.6)
    axes.set_axisbelow(True)


def draw_map(axes: "Axes", course: Course, plane: Plane) -> None:
    """Draw the tracks of all agents with their starts and ends, and the final state of each task."""
    prepare(axes, course, plane)
    _draw_tracks(axes, course, plane)
    (states,) = zip(*task_states(course, np.array([course.end])), strict=True)
    area, where = task_areas(course), plane.where.tasks
    for state, colour in TASK_COLOURS.items():
        chosen = np.array([one == state for one in states])
        if chosen.any():
            axes.scatter(
                where[chosen, 0],
                where[chosen, 1],
                s=area[chosen],
                marker=MARKS.get(state, "o"),
                facecolors=colour if state in MARKS else "white",
                edgecolors="white" if state in MARKS else colour,
                linewidths=0.8 if state in MARKS else 2.0,
                alpha=0.92,
                zorder=4,
                label=f"task {state if state in MARKS else 'left'}",
            )


def _draw_tracks(axes: "Axes", course: Course, plane: Plane) -> None:
    from matplotlib.collections import LineCollection

    n = len(course.legs)
    is_few = n <= len(SERIES)
    names, colours = short_names(course.mission.instance.agent_ids, 18), agent_colours(n)
    tracks = [track(course, agent, plane) for agent in range(n)]
    alpha = 0.85 if is_few else float(np.clip(12 / n, 0.12, 0.5))
    lines = LineCollection(tracks, colors=colours, linewidths=1.5 if is_few else 0.8, alpha=alpha, zorder=2)
    axes.add_collection(lines, autolim=False)
    starts = np.array([corners[0] if len(corners) else (np.nan, np.nan) for corners in tracks])
    for agent, name in enumerate(names if is_few else []):
        axes.plot([], [], color=colours[agent], linewidth=2, label=plain_text(name))
    axes.scatter(
        starts[:, 0],
        starts[:, 1],
        s=26 if is_few else 9,
        marker="s",
        color=colours,
        zorder=3,
        label="start of agent",
    )
    failed = [
        corners[-1]
        for legs, corners in zip(course.legs, tracks, strict=True)
        if legs and legs[-1].status is AgentStatus.FAILED
    ]
    if failed:
        ends = np.array(failed)
        axes.scatter(
            ends[:, 0], ends[:, 1], s=44, marker=FAILED, color="black", linewidths=1.6, zorder=5, label="agent failed"
        )


def name_tasks(axes: "Axes", course: Course, plane: Plane) -> "dict[int, Annotation]":
    """Label tasks where there is room, and return the labels by task; the layout must be final."""
    instance = course.mission.instance
    if instance.m > MAX_NAMES:
        return {}
    size, place = 8.0, plane.where.tasks
    names = [plain_text(name) for name in short_names(instance.task_ids, 18)]
    centre = axes.transData.transform(place) * 72 / axes.figure.dpi
    width = np.array([0.62 * size * len(name) for name in names])
    middle = place_labels(centre, np.sqrt(task_areas(course) / np.pi), width, 1.1 * size, _frame(axes))
    named = np.flatnonzero(~np.isnan(middle[:, 0])).tolist()
    return {j: write(axes, names[j], place[j], middle[j] - centre[j], size) for j in named}


def _frame(axes: "Axes") -> FloatArray:
    """Return both ends of the four lines around a map, in points, so that labels can avoid them."""
    (left, bottom), (right, top) = axes.bbox.get_points() * 72 / axes.figure.dpi
    corners = np.array([(left, bottom), (right, bottom), (right, top), (left, top)])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def write(axes: "Axes", text: str, place: FloatArray, offset: FloatArray, size: float) -> "Annotation":
    """Write a label at an offset in points from a position."""
    from matplotlib.patheffects import withStroke

    return axes.annotate(
        text,
        (float(place[0]), float(place[1])),
        xytext=(float(offset[0]), float(offset[1])),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=size,
        zorder=6,
        path_effects=[withStroke(linewidth=2, foreground="white")],
    )
