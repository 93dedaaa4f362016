"""The left half of a drawing: tasks, groups and moves, projected along the axis with the least spread."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plotting.colours import MOVE, UNSERVED, colour_range, colours, scale, shades, unserved_tasks
from alloc.allocators.plotting.labels import place_labels, visible
from alloc.allocators.plotting.moves import flows, two_axes, wedges
from alloc.problems.text import one_line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from alloc.allocators import Result
    from alloc.problems.instance import FloatArray, IntArray

MAX_LABELS = 60
"""Number of tasks above which they are not labelled."""

MAX_AGENTS = 20_000
"""Number of agents above which a sample is drawn: more dots and wedges would only overlap."""

Plane = tuple[int, int]


def drawn_agents(result: "Result") -> "IntArray":
    """Return the agents whose starts and moves are drawn: all, or evenly spaced ones of many."""
    n = result.instance.n
    return np.unique(np.linspace(0, n - 1, min(n, MAX_AGENTS)).astype(np.intp))


def draw_sites(axes: "Axes", result: "Result") -> "tuple[FloatArray, FloatArray]":
    """Draw circles, starts and moves; return places and radii (in points) of the circles for `name_sites`."""
    plane = two_axes(result.instance)
    sites = result.instance.task_position[:, list(plane)]
    area = _areas(result, sites)
    _draw_starts(axes, result, plane)
    _draw_moves(axes, result, plane)
    _draw_tasks(axes, result, sites, area)
    _finish(axes, result, plane)
    return sites, np.sqrt(area / np.pi)


def _areas(result: "Result", sites: "FloatArray") -> "FloatArray":
    """Return the areas of the circles in square points: proportional to the workloads, within limits."""
    work = result.instance.workload
    known = sites[~np.isnan(sites[:, 0])]
    largest = float(np.clip(15_000 / len(work), 80, 700))
    if 2 < len(known) <= 2_000:
        distance = np.hypot(*(known[:, None, :] - known[None, :, :]).transpose(2, 0, 1))
        np.fill_diagonal(distance, np.inf)
        share = float(np.median(distance.min(axis=1))) / (float(np.ptp(known, axis=0).max()) or 1.0)
        largest = float(np.clip(np.pi * (330 * share) ** 2, 60, largest))  # the half is some 330 points wide
    return np.maximum(12.0, largest * work / max(float(work.max()), 1e-300))


def _draw_starts(axes: "Axes", result: "Result", plane: Plane) -> None:
    """Draw agents that do not start at a task as dots, hollow for idle ones."""
    instance, agents = result.instance, drawn_agents(result)
    start = instance.start_position[agents]
    place = start[:, list(plane)]
    idle = np.ones(len(agents), dtype=bool)
    if result.allocation is not None:
        idle = result.allocation.task_of_agent[agents] < 0
    at_task = {tuple(row) for row in instance.task_position.tolist()}
    own = np.array([tuple(row) not in at_task for row in start.tolist()]) & ~np.isnan(place[:, 0])
    size = float(np.clip(3_000 / instance.n, 4, 28))
    busy, free = own & ~idle, own & idle
    axes.scatter(place[busy, 0], place[busy, 1], s=size, color=MOVE, linewidths=0, zorder=2)
    axes.scatter(place[free, 0], place[free, 1], s=size, facecolors="none", edgecolors=MOVE, linewidths=0.8, zorder=2)


def _draw_moves(axes: "Axes", result: "Result", plane: Plane) -> None:
    from matplotlib.collections import PolyCollection

    if result.allocation is None:
        return
    places = np.vstack([result.instance.task_position, result.instance.start_position])[:, list(plane)]
    extent = float(np.ptp(places[~np.isnan(places[:, 0])], axis=0).max()) or 1.0
    shapes = wedges(flows(result.instance, result.allocation, drawn_agents(result)), plane, extent)
    alpha = float(np.clip(40 / max(len(shapes), 1), 0.12, 0.55))
    axes.add_collection(PolyCollection(shapes, facecolors=MOVE, alpha=alpha, linewidths=0, zorder=1))


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


def _window(result: "Result", plane: Plane) -> "tuple[FloatArray, FloatArray]":
    """Return the limits of both axes: a quarter wider than high, with a margin for circles and labels."""
    places = np.vstack([result.instance.task_position, result.instance.start_position])[:, list(plane)]
    places = places[~np.isnan(places[:, 0])]
    low, high = places.min(axis=0), places.max(axis=0)
    size = max(float((high - low)[0]) / 1.25, float((high - low)[1])) or 1.0
    half = 0.58 * size * np.array([1.25, 1.0])
    return (low + high) / 2 - half, (low + high) / 2 + half


def _finish(axes: "Axes", result: "Result", plane: Plane) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    low, high = _window(result, plane)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("xyz"[plane[0]])
    axes.set_ylabel("xyz"[plane[1]])
    counts = ", number = agents" if result.instance.m <= MAX_LABELS else ""
    sample = f"; {MAX_AGENTS} of the agents are drawn" if result.instance.n > MAX_AGENTS else ""
    axes.set_title(f"circle = task (area = workload{counts}); wedge = move, thin end at the task{sample}", fontsize=9)
    axes.grid(color="0.92", linewidth=0.6)
    axes.set_axisbelow(True)
    bar = ScalarMappable(Normalize(*colour_range(result)), scale())
    axes.figure.colorbar(bar, ax=axes, label="completion time (h)", shrink=0.8, pad=0.02)


def name_sites(axes: "Axes", result: "Result", sites: "FloatArray", radius: "FloatArray") -> None:
    """Write ids beside the circles and numbers of agents into them, where there is room.

    The layout must be final, since labels are placed by distances on paper.
    """
    if result.instance.m > MAX_LABELS:
        return
    size = 8.0 if result.instance.m <= MAX_LABELS // 2 else 6.5
    names = [shortened(name, 12) for name in result.instance.task_ids]
    centre = axes.transData.transform(sites) * 72 / axes.figure.dpi
    width = np.array([0.62 * size * len(name) for name in names])
    middle = place_labels(centre, radius, width, 1.1 * size)
    for j in np.flatnonzero(~np.isnan(middle[:, 0])):
        _write(axes, plain_text(names[j]), sites[j], middle[j] - centre[j], size, "black")
    counts, dark = _group_sizes(result), shades(result) > 0.5
    room = visible(centre, radius, 0.5 * size) & ~unserved_tasks(result)
    for j in np.flatnonzero(room & (radius >= 0.65 * size) & ~np.isnan(centre[:, 0])):
        if 0.31 * size * len(str(counts[j])) < radius[j]:
            _write(axes, str(counts[j]), sites[j], np.zeros(2), size, "white" if dark[j] else "black")


def _group_sizes(result: "Result") -> "IntArray":
    """Return the number of agents on each task."""
    if result.allocation is None:
        return np.zeros(result.instance.m, dtype=np.intp)
    task = result.allocation.task_of_agent
    return np.bincount(task[task >= 0], minlength=result.instance.m)


def _write(axes: "Axes", text: str, site: "FloatArray", offset: "FloatArray", size: float, colour: str) -> None:
    from matplotlib.patheffects import withStroke

    outline = [withStroke(linewidth=2, foreground="white")] if colour == "black" and offset.any() else []
    axes.annotate(
        text,
        (float(site[0]), float(site[1])),
        xytext=(float(offset[0]), float(offset[1])),
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=size,
        color=colour,
        zorder=5,
        annotation_clip=False,
        path_effects=outline,
    )


def shortened(name: str, longest: int) -> str:
    """Return `name` on one line, cut to `longest` characters."""
    name = one_line(name)
    return name if len(name) <= longest else name[: longest - 1] + "…"


def plain_text(name: str) -> str:
    """Return `name` escaped, so that matplotlib reads no part of it as mathematics."""
    return name.replace("$", r"\$")
