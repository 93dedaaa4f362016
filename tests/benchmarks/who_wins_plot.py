"""The drawing of `who_wins.py`: small multiples over time, a column per scenario of the paper."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from learned_families import PAPER
from learned_runs import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BLUE, SKY, GREEN, ORANGE, RED, PURPLE, BLACK, GREY, SILVER = (
    "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00", "#cc79a7", "#000000", "#777777", "#b8b8b8",
)  # fmt: skip
STYLES = {
    "gappo": (BLUE, "-", "o"),
    "gappo-ls": (SKY, "-", "s"),
    "ppo": (BLUE, ":", "^"),
    "a2c": (SKY, ":", "v"),
    "dqn": (GREEN, ":", "<"),
    "ddpg": (PURPLE, ":", ">"),
    "local-search": (RED, "--", "D"),
    "ga": (ORANGE, "--", "P"),
    "hedonic": (GREEN, "--", "X"),
    "auction": (PURPLE, "--", "p"),
    "lp-round": (GREY, "--", "h"),
    "greedy": (SILVER, "--", "*"),
    "exact": (BLACK, "-.", "d"),
}
"""Colours that colour-blind readers can tell apart, and a mark for each method; learned methods are solid or dotted."""

PANELS = (
    ("makespan", False, "T beyond 1 h, makespan alone"),
    ("makespan-energy", False, "T beyond 1 h, with energy"),
    ("makespan-energy", True, "energy beyond the least known at T = 1"),
)
"""Objective, whether energy is shown, and label."""

TICKS = {False: (0, 1e-4, 1e-3, 1e-2, 1e-1, 1), True: (0, 1e-3, 1e-2, 1e-1, 1, 10)}
"""Of T and of energy; below the second an axis is linear, so that 0 has a place."""

SLOW = 1e-3
"""Mean excess of T from which a mark of energy is hollow: slower plans take less energy."""

WIDTH = 0.66
"""Share of the space between two limits over which the methods stand side by side."""

Cells = dict[tuple[str, str, str, float], list[Row]]
Least = dict[tuple[str, int], tuple[float, float]]


def draw(found: Cells, least: Least, path: Path) -> None:
    """Draw mean excess of T over the least, and of energy, against the time limit."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    families = [family for family in PAPER if any(key[1] == family for key in found)]
    figure = Figure(figsize=(2.9 * len(families) + 1.6, 8.5), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(len(PANELS), len(families), sharex=True, sharey="row", squeeze=False)
    limits = sorted({key[3] for key in found})
    for line, (objective, energy, label) in zip(grid, PANELS, strict=True):
        for axes, family in zip(line, families, strict=True):
            of_panel = {key[2:]: rows for key, rows in found.items() if key[:2] == (objective, family)}
            for name in STYLES:
                _curve(axes, name, [of_panel.get((name, limit), []) for limit in limits], least, energy=energy)
            _frame(axes, limits, TICKS[energy])
        line[0].set_ylabel(label)
    for axes, family in zip(grid[0], families, strict=True):
        axes.set_title(f"scenario {family[-1]}", fontsize=10)
    handles = {text: mark for axes in grid.flat for mark, text in zip(*axes.get_legend_handles_labels(), strict=True)}
    order = [name for name in STYLES if name in handles]
    figure.legend([handles[name] for name in order], order, loc="outside right center", frameon=False, fontsize=9)
    figure.supxlabel(
        "time limit (hollow: mean T more than 0.1 % beyond 1 h, so that energy may fall below)", fontsize=9
    )
    figure.savefig(path, dpi=130)


def _curve(axes: "Axes", name: str, of_limits: list[list[Row]], least: Least, *, energy: bool) -> None:
    colour, style, mark = STYLES[name]
    learned, shift = style != "--" and name != "exact", WIDTH * (list(STYLES).index(name) / (len(STYLES) - 1) - 0.5)
    width, order = (1.6, 4) if learned else (0.9, 3)
    points = [(x + shift, _excess(rows, least)) for x, rows in enumerate(of_limits) if rows]
    whole = [(x, both[energy], both[0]) for x, both in points if both is not None]
    if not whole:
        return
    x, y, slow = zip(*whole, strict=True)
    y = np.maximum(y, 0.0)
    axes.plot(x, y, style, color=colour, linewidth=width, alpha=0.7, clip_on=False, zorder=order)
    axes.plot([], [], style, color=colour, marker=mark, markersize=6, linewidth=width, label=name)
    for here, value, excess in zip(x, y, slow, strict=True):
        face = "white" if energy and excess > SLOW else colour
        axes.plot(here, value, mark, color=colour, markerfacecolor=face, markersize=6, clip_on=False, zorder=order)


def _frame(axes: "Axes", limits: list[float], ticks: tuple[float, ...]) -> None:
    axes.set_xticks(range(len(limits)), [f"{1000 * limit:g} ms" if limit < 1 else f"{limit:g} s" for limit in limits])
    axes.set_xlim(-0.5, len(limits) - 0.5)
    for between in range(1, len(limits)):
        axes.axvline(between - 0.5, color="0.9", linewidth=0.8)
    axes.set_yscale("symlog", linthresh=ticks[1], linscale=0.5)
    axes.set_yticks(ticks, [f"{100 * tick:g} %" for tick in ticks])
    axes.set_ylim(bottom=0)
    axes.grid(color="0.92", axis="y")
    axes.minorticks_off()
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=8)


def _excess(rows: list[Row], least: Least) -> tuple[float, float] | None:
    """Return the mean excess of T and of energy; None where a run has no answer, leaves a task, or is late."""
    if any(row.why or row.unserved or row.late for row in rows):
        return None
    places = [least[row.task.family, row.task.seed] for row in rows]
    makespan = [row.makespan / best - 1 for row, (best, _) in zip(rows, places, strict=True)]
    energy = [row.energy / best - 1 for row, (_, best) in zip(rows, places, strict=True)]
    return float(np.mean(makespan)), float(np.mean(energy))
