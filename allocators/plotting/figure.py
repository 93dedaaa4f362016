"""The plot of a result."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.sites import draw_sites, name_sites, plain_text
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.allocators.plotting.times import MAX_ROWS, draw_times
from alloc.problems.text import counted, labelled, number, percent, shortened
from alloc.problems.units import labels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from alloc.allocators import Result


def plot(result: "Result", path: str | None = None) -> "Figure":
    """Draw a result: a map with moves, and the completion times of tasks; without positions, only the latter.

    Parameters
    ----------
    result : Result
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
    return drawn(lambda: _draw(result), path)


def _draw(result: "Result") -> "Figure":
    if np.isnan(result.instance.task_position[:, 0]).all():
        rows = min(result.instance.m, MAX_ROWS)
        figure = new_figure(7.5, float(np.clip(2.0 + 0.25 * rows, 3.0, 6.2)))
        draw_times(figure.subplots(), result)
        figure.suptitle(_title(result), fontsize=12)
        return figure
    figure = new_figure(13, 6.6)
    figure.suptitle(_title(result), fontsize=12)
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1])
    sites = draw_sites(left, result)
    draw_times(right, result)
    figure.draw_without_rendering()  # fixes the layout, on which the positions of labels depend
    name_sites(left, result, sites)
    return figure


def _title(result: "Result") -> str:
    name = plain_text(shortened(result.instance.name, 60))
    text = f"{name}: {counted(result.instance.n, 'agent')}, {counted(result.instance.m, 'task')}, {result.method}"
    if result.evaluation is None:
        return f"{text}\nno allocation found"
    units = labels(result.instance)
    energy = f"energy {labelled(number(result.energy, 6), units.energy)}"
    if result.makespan is None:
        return f"{text}\n{counted(len(result.evaluation.unserved_tasks), 'task')} unserved, {energy}"
    return f"{text}\nT = {labelled(number(result.makespan, 4), units.time)}, gap {percent(result.gap)}, {energy}"
