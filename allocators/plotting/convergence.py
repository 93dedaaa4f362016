"""The plot of runs: makespan, bound and energy over time."""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

from alloc.allocators.plan.palette import SERIES
from alloc.allocators.plotting.sites import plain_text
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.problems import InputError, Objective
from alloc.problems.text import counted, heading, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from alloc.allocators import Result
    from alloc.allocators.contract.improvement import TracePoint


def plot_convergence(results: "Result | Sequence[Result]", path: str | None = None) -> "Figure":
    """Draw runs on one instance: makespan and proven bound over time, and energy if it is part of the objective.

    Parameters
    ----------
    results : Result or sequence of Result
        Results on one instance, with any methods and seeds.
    path : str, optional
        A .png, .svg or .pdf file to write the figure to, atomically.

    Returns
    -------
    matplotlib.figure.Figure
        A figure with its own canvas; matplotlib's current figure is not changed.

    Raises
    ------
    InputError
        If there is no result, the results are on several instances, or `path` has another suffix or cannot be written.
    """
    found = list(results) if isinstance(results, Sequence) else [results]
    if not found:
        raise InputError("must contain at least one result", "results")
    if len({(result.instance.name, result.instance.n, result.instance.m) for result in found}) > 1:
        raise InputError("must be on one instance", "results")
    return drawn(lambda: _draw(found), path)


def _draw(results: "list[Result]") -> "Figure":
    instance = results[0].instance
    with_energy = any(result.objective is Objective.MAKESPAN_ENERGY for result in results)
    figure = new_figure(8, 6.4 if with_energy else 4.2)
    panels = figure.subplots(2 if with_energy else 1, 1, sharex=True, squeeze=False)[:, 0]
    for result, label, colour in zip(results, _labels(results), _colours(len(results)), strict=True):
        _draw_run(panels[0], result, "makespan", label=label, colour=colour)
        if with_energy:
            _draw_run(panels[1], result, "energy", label=label, colour=colour)
    bounds = [result.lower_bound for result in results if result.lower_bound is not None]
    if bounds:
        panels[0].axhline(max(bounds), color="0.4", linestyle="--", linewidth=1.2, label="best lower bound")
    panels[0].set_ylabel(heading("makespan", instance.units.time))
    if with_energy:
        panels[1].set_ylabel(heading("energy", instance.units.energy))
    for axes in panels:
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.92", linewidth=0.6)
    panels[-1].set_xlabel("time (s)")
    panels[-1].set_xscale("log")
    if panels[0].get_legend_handles_labels()[0]:
        panels[0].legend(frameon=False, fontsize=9)
    size = f"{counted(instance.n, 'agent')}, {counted(instance.m, 'task')}"
    figure.suptitle(f"{plain_text(shortened(instance.name, 60))}: {size}", fontsize=12)
    return figure


def _draw_run(axes: "Axes", result: "Result", field: str, *, label: str, colour: str) -> None:
    """Draw makespan or energy of a run as a step function, from its first allocation to its end."""
    points = [(point.time_s, value) for point in result.trace if (value := _value(point, field)) is not None]
    if not points:
        return
    time = [max(one, SHORTEST_S) for one, _ in points] + [max(result.runtime_s, points[-1][0], SHORTEST_S)]
    values = [value for _, value in points]
    axes.step(time, [*values, values[-1]], where="post", color=colour, linewidth=1.6, label=plain_text(label))
    axes.plot(time[-1], values[-1], "o", color=colour, markersize=4)


def _value(point: "TracePoint", field: str) -> float | None:
    return point.makespan if field == "makespan" else point.energy


def _labels(results: "list[Result]") -> list[str]:
    """Return the names of the methods, with seeds if a method ran several times."""
    count = Counter(result.method for result in results)
    return [f"{result.method}, seed {result.seed}" if count[result.method] > 1 else result.method for result in results]


def _colours(count: int) -> list[str]:
    return [SERIES[place % len(SERIES)] for place in range(count)]


SHORTEST_S = 1e-4
"""Smallest time in seconds that is shown on the logarithmic axis."""
