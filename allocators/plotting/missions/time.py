"""Plots over the hours of a mission: tasks by state, work left, messages, and a Gantt chart of agents."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.missions.states import (
    AGENT_COLOURS,
    MISSED,
    TASK_COLOURS,
    WAITING,
    WORKING,
    doing,
    task_states,
)
from alloc.allocators.plotting.sites import plain_text
from alloc.problems.missions.course import Course
from alloc.problems.text import heading, short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS = 700
"""Number of hours at which curves are evaluated."""

MAX_ROWS = 45
"""Number of agents above which their rows are not labelled."""

LETTER = 0.62
"""Ratio of the width of a letter to its height."""


def _hours(course: Course) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return evenly spaced hours, and the hours at which tasks change unless these are too many."""
    even = np.linspace(0, course.end or 1.0, POINTS)
    changes = np.array([level.hour for levels in course.levels for level in levels])
    return np.unique(np.concatenate([even, changes])) if len(changes) < 5 * POINTS else even


def draw_tasks(axes: "Axes", course: Course) -> None:
    """Draw the number of tasks in each state as a stacked plot, with done tasks at the bottom."""
    hours = _hours(course)
    states = np.array(task_states(course, hours), dtype=object).reshape(len(course.levels), len(hours))
    counts = {state: (states == state).sum(axis=0) for state in TASK_COLOURS}
    shown = [state for state in TASK_COLOURS if counts[state].any()]
    areas = (
        axes.stackplot(
            hours,
            [counts[state] for state in shown],
            colors=[TASK_COLOURS[state] for state in shown],
            labels=shown,
            step="post",
        )
        if shown
        else []
    )
    for state, area in zip(shown, areas, strict=True):
        if state == MISSED:
            area.set(hatch="////", edgecolor="white", linewidth=0)
    axes.set_ylim(0, max(1, len(course.levels)) * 1.02)
    axes.set_ylabel("tasks")
    axes.locator_params(axis="y", integer=True)
    _beside(axes)


def draw_work(axes: "Axes", course: Course) -> None:
    """Draw the total work left of the tasks that have appeared."""
    hours = _hours(course)
    left = course.work_left(hours).sum(axis=0)
    axes.fill_between(hours, left, color=TASK_COLOURS[WAITING], alpha=0.25, linewidth=0)
    axes.plot(hours, left, color="#8c3f6a", linewidth=1.5)
    axes.set_ylim(0, (float(left.max(initial=0.0)) or 1.0) * 1.06)
    axes.set_ylabel(plain_text(heading("work left", course.mission.instance.units.work)))


def draw_messages(axes: "Axes", course: Course) -> None:
    """Draw the rate of messages sent, and of those received by any agent."""
    sent = np.array([hour for hour, _, _ in course.messages])
    heard = np.array([hour for hour, _, hearers in course.messages if hearers])
    period = course.mission.radio.period
    width = period * max(1, round((course.end or 1.0) / 60 / period))  # whole periods, so that bars are even
    edges = np.arange(-period / 2, course.end + width, width)
    span = np.minimum(edges[1:], course.end + period / 2) - edges[:-1]  # the last bar holds fewer hours
    for hours, colour, label in ((sent, "#c3ccd4", "not received"), (heard, "#0072b2", "received")):
        count = np.histogram(hours, edges)[0] / np.maximum(span, period)
        axes.bar(edges[:-1], count, width, align="edge", color=colour, label=label, linewidth=0)
    axes.set_ylabel(f"messages per {course.mission.instance.units.time or 'hour'}")
    _beside(axes)


def _beside(axes: "Axes") -> None:
    """Draw a legend on the right of the axes, in the order of the stacked areas."""
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(
        handles[::-1],
        labels[::-1],
        loc="center left",
        bbox_to_anchor=(1.0, 0.5),
        frameon=False,
        fontsize=8,
        handlelength=1.2,
    )


def draw_gantt(axes: "Axes", course: Course) -> None:
    """Draw a Gantt chart with a row for each agent: when it was flying, working, idle and away."""
    from matplotlib.patches import Patch

    n = len(course.legs)
    height = 0.82 if n <= MAX_ROWS else 1.0
    found = set()
    for agent, legs in enumerate(course.legs):
        for state in {doing(leg) for leg in legs if leg.end > leg.begin} - {None}:
            assert state is not None
            found.add(state)
            spans = [(leg.begin, leg.end - leg.begin) for leg in legs if doing(leg) == state]
            axes.broken_barh(
                spans,
                (agent - height / 2, height),
                facecolors=AGENT_COLOURS[state],
                edgecolor="white",
                linewidth=0.7 if n <= MAX_ROWS else 0,
                rasterized=n > MAX_ROWS,
            )
    axes.set_xlim(0, course.end or 1.0)
    axes.set_ylim(n - 0.4, -0.6)
    axes.set_xlabel(heading("time", course.mission.instance.units.time))
    if n <= MAX_ROWS:
        names = [plain_text(name) for name in short_names(course.mission.instance.agent_ids, 16)]
        axes.set_yticks(range(n), names, fontsize=8 if n <= 25 else 6)
        axes.tick_params(axis="y", length=0)
    else:
        axes.set_ylabel(f"{n} agents")
    axes.legend(
        handles=[Patch(color=colour, label=state) for state, colour in AGENT_COLOURS.items() if state in found],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(AGENT_COLOURS),
        frameon=False,
        fontsize=8,
        handlelength=1.2,
        borderaxespad=0.2,
    )


def name_work(axes: "Axes", course: Course) -> None:
    """Write the names of tasks into the bars of working agents where there is room; the layout must be final."""
    n = len(course.legs)
    if n > MAX_ROWS:
        return
    size = 7.0 if n <= 25 else 5.5
    names = short_names(course.mission.instance.task_ids, 14)
    width = axes.bbox.width * 72 / axes.figure.dpi / (course.end or 1.0)
    for agent, legs in enumerate(course.legs):
        for leg in legs:
            if doing(leg) == WORKING and LETTER * size * len(names[leg.task]) + 3 < width * (leg.end - leg.begin):
                middle = (leg.begin + leg.end) / 2
                axes.text(middle, agent, plain_text(names[leg.task]), ha="center", va="center_baseline", fontsize=size)
