"""The plot of a Pareto front of makespan and energy."""

import math
from typing import TYPE_CHECKING

from alloc.allocators.plotting.colours import LIMIT, MAKESPAN
from alloc.allocators.plotting.sites import plain_text
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.problems.text import counted, heading, labelled, number, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from alloc.allocators import Result
    from alloc.allocators.pareto import Front

WIDE = 3.0
"""Ratio of the largest to the smallest makespan above which the axis is logarithmic."""

MAX_TICKS = 9
"""Maximum number of tick labels on a logarithmic axis."""

TENTHS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Multiples of powers of ten that are labelled on a short axis."""


def plot_front(front: "Front", path: str | None = None) -> "Figure":
    """Draw a front: the least energy found and its proven bound, as step functions of the makespan.

    If tasks are unserved, the makespan is that of the served tasks, there are no bounds, and the title gives their
    number.

    Parameters
    ----------
    front : Front
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
    return drawn(lambda: _draw(front), path)


def _draw(front: "Front") -> "Figure":
    figure = new_figure(8, 5.2)
    axes = figure.subplots()
    hours = [result.served_makespan or 0.0 for result in front.points]
    energy = [result.energy or 0.0 for result in front.points]
    wide = hours[0] > 0 and hours[-1] > WIDE * hours[0]
    span = hours[-1] - hours[0] or hours[0] or 1.0  # also for a front of a single point
    end = hours[-1] * (1.25 if wide else 1.0) + 0.05 * span
    axes.step([*hours, end], [*energy, energy[-1]], where="post", color=MAKESPAN, linewidth=1.6, zorder=3)
    axes.plot(hours, energy, "o", color=MAKESPAN, markersize=6, clip_on=False, zorder=4, label="best found")
    unserved = front.points[0].unserved_count
    if not unserved:
        _draw_bounds(axes, front)
    axes.set_xlim(hours[0] / 1.1 if wide else hours[0] - 0.08 * span, end)
    if wide:
        _logarithmic(axes)
    axes.set_ylim(0, max(energy) * 1.08 or 1.0)
    what = "makespan of the served tasks" if unserved else "makespan"
    axes.set_xlabel(heading(what, front.instance.units.time))
    axes.set_ylabel(heading("energy", front.instance.units.energy))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    axes.set_title(_title(front), fontsize=12)
    return figure


def _draw_bounds(axes: "Axes", front: "Front") -> None:
    """Shade the region that is proven infeasible: below the energy bound of each run, up to its makespan limit."""
    proven = [
        (max(result.makespan or 0.0, result.makespan_limit or 0.0), result.energy_lower_bound or 0.0)
        for result in front.points
    ]
    left = front.points[0].lower_bound or 0.0
    axes.axvspan(0, left, color=LIMIT, alpha=0.35, linewidth=0)
    for place, (limit, bound) in enumerate(proven):
        label = "proven infeasible" if place == 0 else None
        axes.fill_between([left, limit], 0, bound, color=LIMIT, alpha=0.35, linewidth=0, label=label)
        left = limit


def _logarithmic(axes: "Axes") -> None:
    from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(FixedLocator(log_ticks(*axes.get_xlim())))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def log_ticks(low: float, high: float) -> list[float]:
    """Return round numbers in a range as ticks, at most `MAX_TICKS`; on a long axis, only powers of ten."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    choices = [(TENTHS, 1), ((1.0, 2.0, 5.0), 1), *(((1.0,), step) for step in range(1, len(decades) + 1))]
    for factors, step in choices:
        ticks = [factor * 10.0**decade for decade in decades[::step] for factor in factors]
        found = [tick for tick in ticks if low <= tick <= high]
        if len(found) <= MAX_TICKS:
            return found
    return []


def _title(front: "Front") -> str:
    instance = front.instance
    name = plain_text(shortened(instance.name, 60))
    fastest, cheapest = _figures(front.points[0]), _figures(front.points[-1])
    ends = fastest if fastest == cheapest else f"from {fastest} to {cheapest}"
    return f"{name}: {counted(instance.n, 'agent')}, {counted(instance.m, 'task')}\n{ends}"


def _figures(result: "Result") -> str:
    units = result.instance.units
    energy = f"energy {labelled(number(result.energy, 6), units.energy)}"
    if result.unserved_count:
        return f"{counted(result.unserved_count, 'task')} unserved, {energy}"
    return f"T = {labelled(number(result.makespan, 4), units.time)}, {energy}"
