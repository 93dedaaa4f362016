"""The plot of a completed mission."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.missions.map import draw_map, name_tasks, plane_of
from alloc.allocators.plotting.missions.time import draw_gantt, draw_messages, draw_tasks, draw_work, name_work
from alloc.allocators.plotting.sites import plain_text
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.problems.text import counted, labelled, number, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from alloc.problems.missions.course import Course


def plot_mission(course: "Course", path: str | None = None) -> "Figure":
    """Draw a mission: the tracks of agents on a map, and tasks by state, work left, messages and agents over time.

    Parameters
    ----------
    course : Course
        The course from a `Recorder`, or from a log by `course_of`.
    path : str, optional
        A .png, .svg or .pdf file to write the figure to, atomically.

    Returns
    -------
    matplotlib.figure.Figure
        A figure with its own canvas; matplotlib's current figure is not changed.

    Raises
    ------
    InputError
        If `path` has another suffix or cannot be written.
    """
    return drawn(lambda: _draw(course), path)


def _draw(course: "Course") -> "Figure":
    n, plane = len(course.legs), plane_of(course.mission.instance)
    rows = float(np.clip(0.9 + 0.2 * n, 1.3, 5.0))
    curves = [draw_tasks, draw_work] + ([draw_messages] if course.messages else [])
    upper = 6.4 if not plane.is_empty else 1.7 * len(curves)
    figure = new_figure(13, upper + rows + 0.7)
    figure.suptitle(title(course), fontsize=12)
    halves = figure.add_gridspec(2, 1, height_ratios=[upper, rows + 0.7])
    above, below = figure.add_subfigure(halves[0]), figure.add_subfigure(halves[1])
    gantt = below.subplots()
    draw_gantt(gantt, course)
    if plane.is_empty:
        right = above
    else:
        sides = above.add_gridspec(1, 2, width_ratios=[1.1, 1])
        left, right = above.add_subfigure(sides[0]), above.add_subfigure(sides[1])
        sites = left.subplots()
        draw_map(sites, course, plane)
        _explain(sites)
    panels = right.subplots(len(curves), 1, sharex=True)
    for axes, draw in zip(panels, curves, strict=True):
        draw(axes, course)
        axes.set_xlim(0, course.end or 1.0)
        axes.grid(color="0.93", linewidth=0.6)
        axes.set_axisbelow(True)
    panels[-1].set_xlabel(gantt.get_xlabel())
    for axes in (gantt, *panels):
        axes.spines[["top", "right"]].set_visible(False)
    figure.draw_without_rendering()  # fixes the layout, on which the positions of labels depend
    if not plane.is_empty:
        name_tasks(sites, course, plane)
    name_work(gantt, course)
    return figure


def _explain(axes: "Axes") -> None:
    from matplotlib.collections import PathCollection
    from matplotlib.legend_handler import HandlerPathCollection

    handles, _ = axes.get_legend_handles_labels()
    axes.legend(
        handles=handles,
        handler_map={PathCollection: HandlerPathCollection(sizes=[40])},  # tasks may be much larger
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        borderaxespad=5.0,  # below the axis label, whatever the height of the map
        ncols=4,
        frameon=False,
        fontsize=8,
        handlelength=1.4,
    )


def title(course: "Course") -> str:
    """Return a title with the mission, the policy and the outcome."""
    instance, result = course.mission.instance, course.result
    name = plain_text(shortened(instance.name, 60))
    size = f"{counted(instance.n, 'agent')}, {counted(instance.m, 'task')}"
    first = f"{name}: {size}, {plain_text(result.policy)}, {result.knowledge} knowledge"
    done = f"{result.tasks_done} of {instance.m} tasks done"
    if result.is_done and result.mission_time is not None:
        done = f"all done at {labelled(number(result.mission_time, 4), instance.units.time or 'h')}"
    energy = f"energy {labelled(number(result.energy, 4), instance.units.energy)}"
    return f"{first}\n{done}, {energy}, {counted(result.switches, 'switch').replace('switchs', 'switches')}"
