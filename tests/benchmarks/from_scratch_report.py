"""The table and the drawing of `from_scratch.py`, for docs/benchmarks/from_scratch.md."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

if TYPE_CHECKING:
    from from_scratch import Row
    from matplotlib.axes import Axes

DOCS = Path(__file__).parents[2] / "docs" / "benchmarks"
BEGIN, END = "<!-- made by tests/benchmarks/from_scratch.py -->", "<!-- end of from_scratch.py -->"

METHODS = ("gappo", "ppo", "a2c", "dqn", "ddpg")
BLUE, SKY, GREEN, ORANGE, PURPLE, RED = "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#cc79a7", "#d55e00"
STYLES = {
    "gappo": (BLUE, "-"),
    "ppo": (RED, "--"),
    "a2c": (SKY, "--"),
    "dqn": (GREEN, "--"),
    "ddpg": (PURPLE, "--"),
    "no GA": (RED, "--"),
    "no attention": (GREEN, "--"),
    "no adaptive rate": (ORANGE, "--"),
    "no energy term": (PURPLE, "--"),
    "no replay": (SKY, "--"),
}
"""Colours that colour-blind readers can tell apart; they are used once in each panel."""

PAPER_BATTERY = {"gappo": "91.9 %", **dict.fromkeys(METHODS[1:], "52.2 to 55.5 %")}
"""Figure 6 of the paper, scenario 1."""

NEAR = (1.1, 1.05)
"""Makespans whose first reaching is reported; the optimum is 1."""

CURVES = (("time", "T - 1 of the median game, geometric mean"), ("battery", "battery left after the episode"))

Runs = list[list["Row"]]
"""The evaluations of each run, in order."""


def interval(values: Sequence[float] | NDArray[np.float64]) -> tuple[float, float]:
    """Return mean and half of its 95 % confidence interval by Student's t; 0 for a single value."""
    mean = float(np.mean(values))
    if len(values) < 2:
        return mean, 0.0
    return mean, float(student.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / len(values) ** 0.5)


def reached(run: list["Row"], makespan: float) -> float:
    """Return the decisions after which a run first was at `makespan`, between evaluations by proportion, or inf."""
    for before, after in pairwise(run):
        if after.time <= makespan < before.time:
            share = (before.time - makespan) / (before.time - after.time)
            return before.decisions + share * (after.decisions - before.decisions)
    return np.inf


def _grouped(rows: Iterable["Row"]) -> dict[str, Runs]:
    """Sort rows by variant, seed and point; keep those seeds alone that all variants have."""
    runs: dict[str, dict[int, list[Row]]] = {}
    for row in sorted(rows, key=lambda row: row.point):
        runs.setdefault(row.variant, {}).setdefault(row.seed, []).append(row)
    seeds = sorted(set.intersection(*(set(of_seeds) for of_seeds in runs.values())))
    return {name: [runs[name][seed] for seed in seeds] for name in STYLES if name in runs}


def _within(values: Sequence[float], form: str = ".3f") -> str:
    mean, half = interval(values)
    return f"{mean:{form}} ± {half:{form}}"


def _first(runs: Runs, makespan: float) -> str:
    """Return the median of `reached`, and how many got there."""
    counts = [reached(run, makespan) for run in runs]
    share = f"{sum(np.isfinite(counts))} of {len(runs)}"
    middle = float(np.sort(counts)[len(counts) // 2])
    return f"{round(middle, -2):,.0f} ({share})" if np.isfinite(middle) else f"- ({share})"


def _title(name: str) -> str:
    return name if name in METHODS else f"gappo, {name}"


def _makespans(found: dict[str, Runs]) -> str:
    """Return how near the runs came to the optimum, and when."""
    lines = [
        ["method", "final T", "spread", "T minus gappo's", *(f"decisions to T = {near}" for near in NEAR), "unserved"]
    ]
    for name, runs in found.items():
        last = [run[-1] for run in runs]
        makespan = [row.time for row in last]
        behind = interval([row.time - other[-1].time for row, other in zip(last, found["gappo"], strict=True)])
        lines.append(
            [
                _title(name),
                _within(makespan),
                f"{np.std(makespan, ddof=1):.3f}" if len(makespan) > 1 else "",
                "" if name == "gappo" else f"{behind[0]:+.3f} ± {behind[1]:.3f}",
                *(_first(runs, near) for near in NEAR),
                _within([row.unserved for row in last], ".2f"),
            ]
        )
    return _markdown(lines)


def _energies(found: dict[str, Runs]) -> str:
    """Return what the episodes took, and what learning took besides decisions."""
    lines = [["method", "episode battery", "in the paper", "moves per agent", "distance", "evaluations", "compared"]]
    for name, runs in found.items():
        last = [run[-1] for run in runs]
        lines.append(
            [
                _title(name),
                _within([100 * row.battery for row in last], ".1f") + " %",
                PAPER_BATTERY.get(name, ""),
                _within([row.hops for row in last], ".2f"),
                _within([row.distance for row in last]),
                f"{np.mean([row.evaluations for row in last]):,.0f}",
                f"{np.mean([row.compared for row in last]):,.0f}",
            ]
        )
    return _markdown(lines)


def _markdown(lines: list[list[str]]) -> str:
    head, *rest = lines
    return "\n".join("| " + " | ".join(line) + " |" for line in [head, ["---", *["--:"] * (len(head) - 1)], *rest])


def curve(runs: Runs, name: str, grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a figure of each run at the same numbers of decisions, shape (runs, points)."""
    return np.array(
        [np.interp(grid, [row.decisions for row in run], [getattr(row, name) for row in run]) for run in runs]
    )


def draw(found: dict[str, Runs], budget: int, path: Path) -> None:
    """Draw makespan and battery over decisions, for the methods and for `gappo` without its parts."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.5, 7.5), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    sides = (METHODS, ("gappo", *(name for name in STYLES if name not in METHODS)))
    grid = np.linspace(0, budget, 41)
    for column, names in enumerate(sides):
        for row, (figure_name, label) in enumerate(CURVES):
            axes = panels[row][column]
            for name in (name for name in names if name in found):
                _draw_curve(axes, name, grid, curve(found[name], figure_name, grid), excess=row == 0)
            axes.grid(color="0.92")
            axes.spines[["top", "right"]].set_visible(False)
            if column == 0:
                axes.set_ylabel(label)
    _frame(panels)
    figure.savefig(path, dpi=110)


def _draw_curve(
    axes: "Axes", name: str, grid: NDArray[np.float64], values: NDArray[np.float64], *, excess: bool
) -> None:
    """Draw mean and 95 % confidence interval over the runs, of the logarithm where it is the excess over 1."""
    colour, style = STYLES[name]
    spread = np.array([interval(np.log(np.maximum(column - 1, 1e-3)) if excess else column) for column in values.T])
    mean, low, high = spread[:, 0], spread[:, 0] - spread[:, 1], spread[:, 0] + spread[:, 1]
    if excess:
        mean, low, high = np.exp(mean), np.exp(low), np.exp(high)
    axes.plot(grid / 1000, mean, style, color=colour, linewidth=2 if name == "gappo" else 1.4, label=_title(name))
    axes.fill_between(grid / 1000, low, high, color=colour, alpha=0.09, linewidth=0)


def _frame(panels: Any) -> None:
    for column, title in enumerate(("five methods", "gappo, and without each of its parts")):
        above, below = panels[0][column], panels[1][column]
        above.set_title(title, fontsize=10)
        above.axhline(0.05, color="0.4", linewidth=1, linestyle=":", label="within 5 % of the optimum")
        above.legend(frameon=False, fontsize=8, loc="upper right")
        below.axhline(0.919, color="0.4", linewidth=1, linestyle=":", label="gappo in the paper, 91.9 %")
        below.axhspan(0.522, 0.555, color="0.4", alpha=0.25, linewidth=0, label="the others in the paper, 52 to 56 %")
        below.legend(frameon=False, fontsize=8, loc="lower left")
        below.set_xlabel("decisions of agents, thousands, all members together")
    first = panels[0][0]
    first.set_yscale("log")
    ticks = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5)
    first.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    first.set_ylim(0.004, 6)
    first.minorticks_off()
    panels[1][0].set_ylim(0, 1)


def publish(rows: list["Row"], budget: int) -> None:
    """Put the table between its marks in docs/benchmarks/from_scratch.md, and the drawing beside the page.

    Raises
    ------
    ValueError
        If the page lacks the marks.
    """
    found = _grouped(rows)
    draw(found, budget, DOCS / "from_scratch.png")
    count = len(found["gappo"])
    text = f"{count} seeds, {budget:,} decisions per run.\n\n{_makespans(found)}\n\n{_energies(found)}"
    page = DOCS / "from_scratch.md"
    before, begun, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    if not begun or END not in rest:
        raise ValueError(f"{page} has no marks {BEGIN} and {END}")
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")
