"""Drawing an answer into a file."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.sites import draw_sites, name_sites, plain_text, shortened
from alloc.allocators.plotting.style import drawing, new_figure, save_figure
from alloc.allocators.plotting.times import MOST_ROWS, draw_times
from alloc.cli.output.console import counted, number, percent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from alloc.allocators import Result


def save_plot(result: "Result", path: str) -> None:
    """Draw `result` into a .png or .svg file, which is written whole or not at all."""
    with drawing():
        save_figure(draw(result), path)


def draw(result: "Result") -> "Figure":
    """Return the drawing of `result`, on a canvas of its own; without positions it shows completion times alone."""
    if np.isnan(result.instance.task_position[:, 0]).all():
        rows = min(result.instance.m, MOST_ROWS)
        figure = new_figure(7.5, float(np.clip(2.0 + 0.25 * rows, 3.0, 6.2)))
        draw_times(figure.subplots(), result)
        figure.suptitle(_title(result), fontsize=12)
        return figure
    figure = new_figure(13, 6.2)
    figure.suptitle(_title(result), fontsize=12)
    left, right = figure.subplots(1, 2, width_ratios=[1.25, 1])
    sites, radius = draw_sites(left, result)
    draw_times(right, result)
    figure.draw_without_rendering()  # settles the layout, by which names are placed
    name_sites(left, result, sites, radius)
    return figure


def _title(result: "Result") -> str:
    name = plain_text(shortened(result.instance.name, 60))
    text = f"{name}: {counted(result.instance.n, 'agent')}, {counted(result.instance.m, 'task')}, {result.method}"
    if result.evaluation is None:
        return f"{text}\nno allocation found"
    energy = f"energy {number(result.energy, 4)}"
    if result.makespan is None:
        return f"{text}\n{counted(len(result.evaluation.unserved_tasks), 'task')} unserved, {energy}"
    return f"{text}\nT = {number(result.makespan, 4)} h, gap {percent(result.gap)}, {energy}"
