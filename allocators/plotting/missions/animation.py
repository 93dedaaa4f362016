"""An animation of a mission: its map over time, as .gif or .mp4."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.missions.map import (
    FAILED,
    Plane,
    agent_colours,
    name_tasks,
    plane_of,
    prepare,
    task_areas,
)
from alloc.allocators.plotting.missions.picture import title
from alloc.allocators.plotting.missions.states import AGENT_COLOURS, TASK_COLOURS, doing, task_states
from alloc.allocators.plotting.style import in_style, new_figure
from alloc.problems import InputError
from alloc.problems.formats import write_bytes_atomically
from alloc.problems.missions.course import Course
from alloc.problems.missions.simulation.state import AgentStatus
from alloc.problems.text import labelled

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".gif", ".mp4", ".html")

FRAMES, PER_SECOND = 120, 12

DPI = 90

TRAIL = 0.08
"""Length of the trail behind an agent, as a share of the mission's duration."""


def check_animation(path: str) -> None:
    """Raise an `InputError` if the suffix of `path` is not that of an animation, or ffmpeg is needed but missing."""
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"must end in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}", source=path)
    if suffix == ".mp4":
        from matplotlib.animation import FFMpegWriter

        if not FFMpegWriter.isAvailable():
            raise InputError(
                "needs the program ffmpeg, which was not found; install it, or write .gif or .html", source=path
            )


def animate_mission(course: Course, path: str, frames: int = FRAMES) -> None:
    """Write a mission as an animation (.gif, .mp4), or as an interactive page (.html).

    Parameters
    ----------
    course : Course
        The course from a `Recorder`, or from a log by `course_of`.
    path : str
    frames : int
        Number of frames, evenly spaced in time; for .gif and .mp4.

    Raises
    ------
    InputError
        If `path` has another suffix or cannot be written, ffmpeg is missing for .mp4, or no positions are known, which
        .gif and .mp4 need.
    """
    check_animation(path)
    if Path(path).suffix.lower() == ".html":
        from alloc.allocators.plotting.missions.player import write_player

        write_player(course, path)
        return
    plane = plane_of(course.mission.instance)
    if plane.is_empty:
        raise InputError("cannot show a mission without positions of agents or tasks; write .html", source=path)
    with in_style():
        write_bytes_atomically(path, _animation_bytes(course, plane, Path(path).suffix.lower(), frames))


def _animation_bytes(course: Course, plane: Plane, suffix: str, frames: int) -> bytes:
    from matplotlib.animation import FFMpegWriter, FuncAnimation, PillowWriter

    hours = np.linspace(0, course.end, frames)
    figure = new_figure(8, 7.2)
    show = draw_animation(figure, course, plane, hours)
    film = FuncAnimation(figure, show, frames=frames, init_func=list, blit=False, cache_frame_data=False)
    writer = (
        PillowWriter(fps=PER_SECOND)
        if suffix == ".gif"
        else FFMpegWriter(fps=PER_SECOND, extra_args=["-pix_fmt", "yuv420p"])
    )
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / f"film{suffix}"
        film.save(str(written), writer=writer, dpi=DPI)
        return written.read_bytes()


def draw_animation(
    figure: "Figure", course: Course, plane: Plane, hours: np.ndarray
) -> "Callable[[int], list[Artist]]":
    """Draw the static parts, and return a function that draws a frame, given its number."""
    from matplotlib.collections import LineCollection

    axes = figure.subplots()
    prepare(axes, course, plane)
    figure.suptitle(title(course), fontsize=10)
    n = len(course.legs)
    clock = axes.text(0.985, 0.985, "", transform=axes.transAxes, ha="right", va="top", fontsize=14, zorder=9)
    area, where = task_areas(course), plane.where.tasks
    edge = axes.scatter(where[:, 0], where[:, 1], s=area, facecolors="white", linewidths=1.6, zorder=3)
    fill = axes.scatter(where[:, 0], where[:, 1], s=area, linewidths=0, zorder=4)
    trails = axes.add_collection(
        LineCollection([], colors=agent_colours(n), alpha=0.6 if n <= 50 else 0.3, zorder=2), autolim=False
    )
    agents = axes.scatter([np.nan] * n, [np.nan] * n, s=60 if n <= 20 else 22 if n <= 100 else 9, marker="s", zorder=5)
    agents.set(edgecolor="#3d4750", linewidth=0.8 if n <= 100 else 0.3)
    failed = axes.scatter([np.nan] * n, [np.nan] * n, s=50 if n <= 20 else 18, marker=FAILED, color="black", zorder=6)
    states, left = task_states(course, hours), course.work_left(hours)
    most = np.maximum([max(level.left for level in levels) for levels in course.levels], 1e-300)
    _explain(axes)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # so that the layout is the same in all frames
    names = name_tasks(axes, course, plane)

    def show(number: int) -> "list[Artist]":
        hour = float(hours[number])
        clock.set_text(labelled(f"{hour:.2f}", course.mission.instance.units.time or "h"))
        now = [row[number] for row in states]
        colours = [TASK_COLOURS.get(state or "", "none") for state in now]
        share = np.clip(left[:, number] / most, 0, 1)
        over = np.array([state in ("done", "missed", "cancelled") for state in now])
        edge.set(facecolor=["white" if state else "none" for state in now], edgecolor=colours)
        edge.set_sizes(np.where(over, 0.25 * area, area))
        fill.set(facecolor=colours)
        fill.set_sizes(np.where(over, 0.25 * area, area * share))
        for j, name in names.items():
            name.set_visible(now[j] is not None)
        _move(course, plane, hour, agents, failed, trails)
        return []

    return show


def _move(course: Course, plane: Plane, hour: float, agents: "Artist", failed: "Artist", trails: "Artist") -> None:
    """Draw the agents at their positions at an hour, failed ones as crosses, with their trails."""
    places, colours, ways, over = [], [], [], []
    for agent, legs in enumerate(course.legs):
        leg = course.leg(agent, hour)
        places.append(plane.point(leg.position(hour)) if leg is not None else (np.nan, np.nan))
        state = None if leg is None else doing(leg)
        colours.append("none" if state is None else AGENT_COLOURS[state])
        over.append(leg is not None and leg.status is AgentStatus.FAILED)
        since = hour - TRAIL * course.end
        way = [
            plane.point(one.position(max(one.begin, since))) for one in legs if one.end >= since and one.begin <= hour
        ]
        ways.append([*way, places[-1]])
    where, is_over = np.array(places, dtype=float).reshape(-1, 2), np.array(over, dtype=np.bool_)[:, None]
    agents.set(offsets=np.where(is_over, np.nan, where), facecolor=colours)
    failed.set(offsets=np.where(is_over, where, np.nan))
    trails.set(segments=ways)


def _explain(axes: "Axes") -> None:
    from matplotlib.lines import Line2D

    entries = [("o", f"task {state}", colour) for state, colour in TASK_COLOURS.items()]
    entries += [("s", f"agent {state}", colour) for state, colour in AGENT_COLOURS.items()]
    entries += [(FAILED, "agent failed", "black")]
    marks = [
        Line2D(
            [],
            [],
            marker=shape,
            linestyle="",
            color=colour,
            markeredgecolor="black" if shape == FAILED else "0.4",
            markeredgewidth=1.5 if shape == FAILED else 0.5,
            label=label,
        )
        for shape, label, colour in entries
    ]
    axes.legend(handles=marks, loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=5, frameon=False, fontsize=8)
