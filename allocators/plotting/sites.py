"""The map in the left half of a plot: tasks, groups, bases and moves."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.places import Base, Places, bases, places
from alloc.allocators.plotting.colours import (
    MOVE,
    UNSERVED,
    colour_range,
    colours,
    is_late_coloured,
    scale,
    shades,
    unserved_tasks,
)
from alloc.allocators.plotting.labels import place_labels, visible
from alloc.allocators.plotting.legend import draw_legend
from alloc.allocators.plotting.moves import flows, wedges
from alloc.allocators.plotting.starts import draw_returns, draw_starts, start_names
from alloc.problems.text import heading, short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from alloc.allocators import Result
    from alloc.problems.instance import FloatArray, IntArray

MAX_LABELS = 60
"""Number of tasks above which they are not labelled."""

MAX_AGENTS = 20_000
"""Number of agents above which only the moves of a sample are drawn, as more wedges would overlap."""

MAX_LINES = 300
"""Maximum number of moves, and of returns, that labels avoid if possible."""

WIDTH = 1.25
"""Ratio of the width of the map to its height."""


@dataclass(frozen=True, eq=False)
class Sites:
    """Positions and sizes of the marks on a map.

    Attributes
    ----------
    where : Places
    bases : list of Base
        Places where agents start, other than tasks.
    radius : ndarray, shape (m + bases,)
        Radii of the marks of tasks and bases, in points.
    lines : ndarray, shape (l, 2, 2)
        Both ends of moves and returns.
    """

    where: Places
    bases: list[Base]
    radius: "FloatArray"
    lines: "FloatArray"


def drawn_agents(result: "Result") -> "IntArray":
    """Return the agents whose moves are drawn: all, or an evenly spaced sample."""
    n = result.instance.n
    return np.unique(np.linspace(0, n - 1, min(n, MAX_AGENTS)).astype(np.intp))


def draw_sites(axes: "Axes", result: "Result") -> Sites:
    """Draw tasks, bases and moves; return what `name_sites` needs."""
    where = places(result.instance)
    begin = [base for base in bases(result.instance, where) if base.task is None]
    area = _areas(result, where)
    low, high = _window(where)
    size = draw_starts(axes, result, begin)
    moves = _draw_moves(axes, result, where, float(high[0] - low[0]))
    returns = draw_returns(axes, result, where, drawn_agents(result))
    lines = np.concatenate([moves[:MAX_LINES], returns[:MAX_LINES]])
    _draw_tasks(axes, result, where.tasks, area)
    _finish(axes, result, where)
    draw_legend(
        axes, result, begin, counts=result.instance.m <= MAX_LABELS, moves=bool(len(moves)), returns=bool(len(returns))
    )
    return Sites(where, begin, np.concatenate([np.sqrt(area / np.pi), size / 2]), lines)


def _areas(result: "Result", where: Places) -> "FloatArray":
    """Return the areas of the circles in square points: proportional to the workloads, within limits."""
    work = result.instance.workload
    known = where.tasks[~np.isnan(where.tasks[:, 0])] * [1.0, where.aspect]
    largest = float(np.clip(15_000 / len(work), 80, 700))
    if 2 < len(known) <= 2_000:
        distance = np.hypot(*(known[:, None, :] - known[None, :, :]).transpose(2, 0, 1))
        np.fill_diagonal(distance, np.inf)
        share = float(np.median(distance.min(axis=1))) / (float(np.ptp(known, axis=0).max()) or 1.0)
        largest = float(np.clip(np.pi * (330 * share) ** 2, 60, largest))  # the map is about 330 points wide
    return np.maximum(12.0, largest * work / max(float(work.max()), 1e-300))


def _draw_moves(axes: "Axes", result: "Result", where: Places, extent: float) -> "FloatArray":
    """Draw a wedge for each group that moves; return both ends of each, largest groups first."""
    from matplotlib.collections import PolyCollection

    if result.allocation is None:
        return np.zeros((0, 2, 2))
    moves = flows(where, result.allocation, drawn_agents(result))
    lines = np.stack([moves.begin, moves.end], axis=1)[np.argsort(-moves.count, kind="stable")]
    shapes = wedges(moves, 0.8 * extent, where.aspect)
    if not shapes:
        return lines
    corner = np.array(shapes) / extent
    across, along = corner[:, 2] - corner[:, 0], corner[:, 1] - corner[:, 0]
    covered = float(np.abs(across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]).sum()) / 2 * where.aspect
    alpha = float(np.clip(min(max(40 / len(shapes), 0.2), 0.3 / max(covered, 0.01)), 0.015, 0.55))
    axes.add_collection(PolyCollection(shapes, facecolors=MOVE, alpha=alpha, linewidths=0, zorder=1))
    return lines


def _draw_tasks(axes: "Axes", result: "Result", sites: "FloatArray", area: "FloatArray") -> None:
    """Draw tasks as circles, small ones on top; unserved ones hollow and crossed out."""
    unserved, known = unserved_tasks(result), ~np.isnan(sites[:, 0])
    order = np.argsort(-area, kind="stable")
    plain = order[(known & ~unserved)[order]]
    axes.scatter(
        sites[plain, 0],
        sites[plain, 1],
        s=area[plain],
        c=colours(result)[plain],
        edgecolors="white",
        linewidths=0.8,
        zorder=3,
    )
    left = known & unserved
    x, y = sites[left].T
    axes.scatter(x, y, s=area[left], facecolors="white", edgecolors=UNSERVED, linewidths=1.6, zorder=3.1)
    axes.scatter(x, y, s=area[left] / 3, marker="x", color=UNSERVED, linewidths=1.4, zorder=3.2)


def _window(where: Places) -> "tuple[FloatArray, FloatArray]":
    """Return the limits of both axes: a quarter wider than high, with a margin for circles and labels."""
    known = where.known
    low, high = known.min(axis=0), known.max(axis=0)
    size = max(float((high - low)[0]) / WIDTH, float((high - low)[1]) * where.aspect) or 1.0
    half = 0.62 * size * np.array([WIDTH, 1 / where.aspect])
    return (low + high) / 2 - half, (low + high) / 2 + half


def _finish(axes: "Axes", result: "Result", where: Places) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize
    from matplotlib.ticker import FuncFormatter

    low, high = _window(where)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect(where.aspect, adjustable="box")
    axes.set_xlabel(plain_text(where.axes[0]))
    axes.set_ylabel(plain_text(where.axes[1]))
    if high[0] > 180 and result.instance.metric == "geographic":
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{(value + 180) % 360 - 180:g}"))
    if result.instance.n > MAX_AGENTS:
        axes.set_title(f"moves of a sample of {MAX_AGENTS} agents", fontsize=9)
    axes.grid(color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    if is_late_coloured(result):
        bar = ScalarMappable(Normalize(*colour_range(result)), scale())
        label = plain_text(heading("completion time", result.instance.units.time))
        axes.figure.colorbar(bar, cax=axes.inset_axes((1.03, 0.1, 0.035, 0.8)), label=label)


def name_sites(axes: "Axes", result: "Result", sites: Sites) -> None:
    """Label tasks and bases, and write numbers of agents into the circles, where there is room.

    The layout must be final, as labels are placed by distances in points.
    """
    instance, m = result.instance, result.instance.m
    is_named = m <= MAX_LABELS
    starts = start_names(result, sites.bases)
    names = [*(short_names(instance.task_ids, 18) if is_named else [""] * m), *starts]
    if not any(names):
        return
    size = 8.0 if len([name for name in names if name]) <= MAX_LABELS // 2 else 6.5
    place = np.vstack([sites.where.tasks, *(base.place for base in sites.bases[: len(starts)])])
    radius = sites.radius[: len(place)].copy()
    radius[: 0 if is_named else m] = 0.0  # if there are many small circles, labels may cover them
    centre = axes.transData.transform(place) * 72 / axes.figure.dpi
    width = np.array([0.62 * size * len(name) for name in names])
    lines = axes.transData.transform(sites.lines.reshape(-1, 2)).reshape(-1, 2, 2) * 72 / axes.figure.dpi
    middle = place_labels(centre, radius, width, 1.1 * size, lines)
    for j in np.flatnonzero(~np.isnan(middle[:, 0])):
        if names[j]:
            colour = "black" if j < m else "#3a4450"
            _write(axes, plain_text(names[j]), place[j], middle[j] - centre[j], size, colour, italic=bool(j >= m))
    if is_named:
        _write_counts(axes, result, centre[:m], radius[:m], size, place[:m])


def _write_counts(
    axes: "Axes", result: "Result", centre: "FloatArray", radius: "FloatArray", size: float, place: "FloatArray"
) -> None:
    counts, dark = _group_sizes(result), shades(result) > 0.5
    room = visible(centre, radius, 0.5 * size) & ~unserved_tasks(result)
    for j in np.flatnonzero(room & (radius >= 0.65 * size) & ~np.isnan(centre[:, 0])):
        if 0.42 * size * len(str(counts[j])) < radius[j]:
            _write(axes, str(counts[j]), place[j], np.zeros(2), size, "white" if dark[j] else "black")


def _group_sizes(result: "Result") -> "IntArray":
    """Return the number of agents on each task."""
    if result.allocation is None:
        return np.zeros(result.instance.m, dtype=np.intp)
    task = result.allocation.task_of_agent
    return np.bincount(task[task >= 0], minlength=result.instance.m)


def _write(
    axes: "Axes", text: str, site: "FloatArray", offset: "FloatArray", size: float, colour: str, *, italic: bool = False
) -> None:
    from matplotlib.patheffects import withStroke

    axes.annotate(
        text,
        (float(site[0]), float(site[1])),
        xytext=(float(offset[0]), float(offset[1])),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=size,
        fontstyle="italic" if italic else "normal",
        color=colour,
        zorder=5,
        annotation_clip=False,
        path_effects=[withStroke(linewidth=2, foreground="white")] if offset.any() else [],
    )


def plain_text(name: str) -> str:
    """Return `name` with dollar signs escaped, so that matplotlib does not interpret it as mathematics."""
    return name.replace("$", r"\$")
