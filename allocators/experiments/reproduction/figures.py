"""Figures 2 to 6 in the form of the paper: makespan over iterations in each scenario, and remaining battery."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.experiments.reproduction.protocol import ITERATIONS, OTHERS, PAPER_BATTERY, PAPER_METHODS
from alloc.allocators.experiments.reproduction.rows import Learned, Solved
from alloc.allocators.experiments.reproduction.summary import latest_length, of_scenario, runs_of, solved_to_the_bound
from alloc.allocators.plan.palette import SERIES
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.problems.generate.paper_scenarios import SCENARIOS
from alloc.problems.text import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = dict(zip(PAPER_METHODS, (SERIES[number] for number in (0, 1, 2, 5, 4)), strict=True))
STYLES = dict(zip(PAPER_METHODS, ("-", "--", "-.", (0, (8, 2)), (0, (5, 1, 1, 1, 1, 1))), strict=True))
MARKS = dict(zip(OTHERS, "os^vD", strict=True))
OPTIMUM = "#e377c2"
"""Pink, as in the paper."""

HIGHEST = 3.0
"""Makespan above which nothing is drawn: at the start a task may be unserved, and the makespan infinite."""


def draw_all(learned: Sequence[Learned], solved: Sequence[Solved], folder: Path) -> None:
    """Draw all five figures as ``figure-2.png`` to ``figure-6.png`` in a folder."""
    kept = latest_length(learned)
    for scenario in ITERATIONS:
        rows, beside = of_scenario(kept, scenario), of_scenario(solved, scenario)
        drawn(partial(_convergence, rows, beside, scenario), str(folder / f"figure-{scenario + 1}.png"))
    drawn(lambda: _batteries(kept), str(folder / "figure-6.png"))


def _convergence(rows: Sequence[Learned], solved: Sequence[Solved], scenario: int) -> "Figure":
    """Draw figure 2, 3, 4 or 5, with the methods that do not learn in a narrow panel on the right."""
    figure = new_figure(8.2, 4.4)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[5, 1])
    for method in (name for name in PAPER_METHODS if any(row.method == name for row in rows)):
        runs = runs_of(rows, method)
        steps = [row.iteration for row in runs[0]]
        table = np.array([[min(row.makespan, HIGHEST) for row in run] for run in runs])
        middle, low, high = (np.quantile(table, share, axis=0) for share in (0.5, 0.25, 0.75))
        style = {"color": COLOURS[method], "linestyle": STYLES[method]}
        left.plot(steps, middle, linewidth=2 if method == "gappo" else 1.4, label=method.upper(), **style)
        left.fill_between(steps, low, high, color=COLOURS[method], alpha=0.12, linewidth=0)
    for number, method in enumerate(OTHERS):
        found = [row.makespan for row in solved if row.method == method and np.isfinite(row.makespan)]
        if found:
            right.plot(number, np.median(found), MARKS[method], color="0.25")
    _frame(left, right, rows, solved)
    sizes = SCENARIOS[scenario]
    counts = {len(runs_of(rows, method)) for method in PAPER_METHODS} - {0} or {0}  # variants alone are not drawn
    extent = counted(max(counts), "run") if len(counts) == 1 else f"{min(counts)} to {max(counts)} runs"
    figure.suptitle(f"{sizes.agents} agents and {sizes.tasks} tasks, {extent}: median and quartiles", fontsize=11)
    return figure


def _frame(left: "Axes", right: "Axes", rows: Sequence[Learned], solved: Sequence[Solved]) -> None:
    bound = float(np.median([row.lower_bound for row in rows]))
    met, total = solved_to_the_bound(rows, solved)
    label = "proven optimum" if met == total else "proven lower bound"
    for axes in (left, right):
        axes.axhline(bound, color=OPTIMUM, linestyle=":", linewidth=1.8, label=label)
        axes.grid(color="0.92", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    left.set_yscale("log")
    ticks = (1, 1.05, 1.1, 1.2, 1.5, 2, 3)
    left.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    left.minorticks_off()
    left.set_ylim(0.985, HIGHEST * 1.02)
    left.set_xlim(0, min(ITERATIONS[rows[0].scenario], rows[0].iterations))
    left.set_xlabel("iteration")
    left.set_ylabel("maximum completion time (h)")
    left.legend(frameon=False, fontsize=9)
    right.set_xlim(-0.6, len(OTHERS) - 0.4)
    right.set_xticks(range(len(OTHERS)), OTHERS, rotation=60, ha="right", fontsize=8)
    right.tick_params(left=False)


def _batteries(rows: Sequence[Learned]) -> "Figure":
    """Draw figure 6: the battery left at the end of the episode, beside the values in the paper."""
    figure = new_figure(8.2, 4.4)
    axes = figure.subplots()
    width = 0.8 / len(PAPER_METHODS)
    for place, scenario in enumerate(ITERATIONS):
        for number, method in enumerate(PAPER_METHODS):
            last = [run[-1].battery for run in runs_of(of_scenario(rows, scenario), method)]
            x = place + (number - len(PAPER_METHODS) / 2 + 0.5) * width
            low, high = PAPER_BATTERY["gappo" if method == "gappo" else "others"][scenario]
            axes.fill_between([x - width / 2, x + width / 2], low - 0.4, high + 0.4, color="0.3", alpha=0.45, lw=0)
            if last:
                label = method.upper() if not place else None
                mean = np.mean(last)
                ends = [[mean - min(last)], [max(last) - mean]]
                axes.bar(x, mean, width * 0.9, color=COLOURS[method], label=label, yerr=ends, zorder=0)
    axes.fill_between([], [], [], color="0.3", alpha=0.45, label="in the paper")
    axes.set_xticks(
        range(len(ITERATIONS)), [f"{SCENARIOS[k].agents} agents, {SCENARIOS[k].tasks} tasks" for k in ITERATIONS]
    )
    axes.set_ylim(0, 100)
    axes.set_ylabel("battery left after the episode (%)")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.12))
    return figure
