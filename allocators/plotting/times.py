"""The right half of a plot: completion times of tasks."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.table import task_rows
from alloc.allocators.plotting.colours import LIMIT, MAKESPAN, UNSERVED, colours, finite_times, shades, unserved_tasks
from alloc.allocators.plotting.sites import plain_text
from alloc.problems.text import heading, labelled, number, short_names

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from alloc.allocators import Result
    from alloc.problems.instance import IntArray

MAX_ROWS = 40
"""Number of tasks above which bars are vertical and not labelled."""

MAX_LETTERS = 70
"""Number of letters of 7 points that fit into a bar over the whole axis."""

MARGIN = 1.06
"""Ratio of the end of the axis to the latest time."""

MAX_BARS = 1_000
"""Number of tasks above which bars are drawn as thin lines."""


def draw_times(axes: "Axes", result: "Result") -> None:
    """Draw a bar per task, unserved tasks first, then the latest first, with makespan and lower bound as lines."""
    from matplotlib.colors import to_rgba

    time, unserved = finite_times(result), unserved_tasks(result)
    order = np.lexsort((-time, ~unserved))
    top = max(float(time.max()), result.makespan or 0.0, result.lower_bound or 0.0) or 1.0
    height, hatched = np.where(unserved, MARGIN * top, time)[order], unserved[order]  # unserved: to the axis end
    fill = colours(result)[order]
    fill[hatched] = 1.0
    rows = result.instance.m <= MAX_ROWS
    thick = 0.8 if result.instance.m <= 150 else 1.0
    if result.instance.m > MAX_BARS:
        fill[hatched] = to_rgba(UNSERVED, 0.3)
        axes.vlines(np.arange(result.instance.m), 0, height, colors=list(map(tuple, fill.tolist())), linewidth=0.5)
    else:
        bars = (axes.barh if rows else axes.bar)(np.arange(result.instance.m), height, thick, color=fill)
        for place in np.flatnonzero(hatched):
            bars[place].set(hatch="////", linewidth=0.8, edgecolor=UNSERVED)
    lines = _lines(axes, result, rows)
    if rows:
        _name_rows(axes, result, order, top)
    else:
        _name_columns(axes, result, top)
    _legend(axes, lines, any_unserved=bool(hatched.any()))


def _lines(axes: "Axes", result: "Result", rows: bool) -> "list[Line2D]":
    """Draw makespan and lower bound as lines with white edges, which are visible on dark bars."""
    from matplotlib.patheffects import withStroke

    draw = axes.axvline if rows else axes.axhline
    wanted = [("makespan", result.makespan, MAKESPAN, "-"), ("lower bound", result.lower_bound, LIMIT, "--")]
    return [
        draw(
            value,
            color=colour,
            linestyle=style,
            linewidth=1.8,
            label=f"{label} {labelled(number(value, 4), result.instance.units.time)}",
            path_effects=[withStroke(linewidth=3.2, foreground="white")],
        )
        for label, value, colour, style in wanted
        if value is not None
    ]


def _name_rows(axes: "Axes", result: "Result", order: "IntArray", top: float) -> None:
    m = result.instance.m
    short = short_names(result.instance.task_ids, 18)
    names = [plain_text(short[j]) for j in order]
    axes.set_yticks(range(m), names, fontsize=8 if m <= 25 else 6.5)
    axes.set_ylim(m - 0.4, -0.6)
    axes.set_xlim(0, MARGIN * top)
    axes.set_xlabel(heading("completion time", result.instance.units.time))
    for row, j in enumerate(order):
        if result.instance.workload[j] == 0:
            axes.text(0.01 * top, row, "no work", va="center", fontsize=7, color="0.4")
    _name_groups(axes, result, order, top)


def _name_groups(axes: "Axes", result: "Result", order: "IntArray", top: float) -> None:
    """Write the names of the agents into the bar of each task, as far as there is room."""
    size = 7.0 if result.instance.m <= 25 else 6.0
    room = MAX_LETTERS * 7.0 / size * finite_times(result) / top
    dark = shades(result) > 0.5
    for place, row in enumerate(task_rows(result, order)):
        text = listed(row.agents, int(room[order[place]])) if row.completion_time else ""
        if text:
            colour = "white" if dark[order[place]] else "black"
            axes.text(0.012 * top, place, plain_text(text), va="center", fontsize=size, color=colour)


def listed(names: Sequence[str], longest: int) -> str:
    """Return as many names as fit into `longest` characters, and the number of others; only a number if none fits."""
    short = short_names(names, 18)
    for count in range(len(short), 0, -1):
        more = f" and {len(short) - count} more" if count < len(short) else ""
        text = ", ".join(short[:count]) + more
        if len(text) <= longest:
            return text
    return f"{len(short)} agents" if short and longest >= 11 else ""


def _name_columns(axes: "Axes", result: "Result", top: float) -> None:
    axes.set_xlim(-0.6, result.instance.m - 0.4)
    axes.set_ylim(0, MARGIN * top)
    axes.set_xlabel("tasks by decreasing completion time")
    axes.set_ylabel(heading("completion time", result.instance.units.time))


def _legend(axes: "Axes", lines: "list[Line2D]", *, any_unserved: bool) -> None:
    from matplotlib.patches import Patch

    entries: list[Artist] = list(lines)
    if any_unserved:
        entries.append(Patch(facecolor="white", edgecolor=UNSERVED, hatch="////", label="unserved"))
    axes.spines[["top", "right"]].set_visible(False)
    if entries:
        axes.legend(
            handles=entries,
            loc="lower center",
            bbox_to_anchor=(0.5, 1.0),
            ncols=len(entries),
            frameon=False,
            fontsize=9,
        )
