"""Draw docs/methods/pictures/, one picture per method on the same instance: ``python docs/make_method_pictures.py``."""

from pathlib import Path

import numpy as np
from make_gallery import reduce_colours
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from alloc.allocators import Result, solve
from alloc.problems import Family, Instance, random_instance

FOLDER = Path(__file__).parent / "methods" / "pictures"
METHODS = (
    "greedy", "hedonic", "auction", "ga", "local-search", "lp-round", "milp", "cpsat", "auto", "gappo", "gappo-ls",
    "ppo", "a2c", "dqn", "ddpg",
)  # fmt: skip
TOGETHER = ("ppo", "a2c", "dqn", "ddpg")
"""Methods that share one picture."""

SECONDS = 1.0
COLOURS = ("#17406d", "#c2571a", "#2f7d4f", "#8a4fa3")


def instance() -> Instance:
    """Return 60 agents with abilities from 1 to 9 and 12 tasks, with equal total ability and workload, in a square."""
    family = Family(
        agents=60, tasks=12, ability_max=9, dimensions=2, starts="own", integer=True, energy_per_distance=1.0
    )
    return random_instance(family, 4)


def draw_plan(axes: Axes, result: Result) -> None:
    """Draw the flights to the tasks; areas are workloads, and later tasks are darker."""
    problem, found = result.instance, result.evaluation
    assert result.allocation is not None
    assert found is not None
    task = result.allocation.task_of_agent
    for agent in np.flatnonzero(task >= 0):
        start, goal = problem.agent_position[agent], problem.task_position[task[agent]]
        axes.plot([start[0], goal[0]], [start[1], goal[1]], color="#7f93a8", lw=0.8, zorder=1)
    axes.scatter(*problem.agent_position[:, :2].T, s=9, color="#333333", zorder=2)
    axes.scatter(
        *problem.task_position[:, :2].T,
        s=9 * problem.workload,
        c=found.completion_time,
        cmap="Oranges",
        vmin=0.85,
        vmax=1.1,
        edgecolors="#7a3610",
        zorder=3,
    )
    axes.set(xticks=[], yticks=[], aspect="equal")
    axes.set_title(f"T = {found.makespan:.3f} h, energy {found.energy:.1f}", fontsize=10)


def draw_course(axes: Axes, results: dict[str, Result], field: str, bound: float, label: str) -> None:
    """Draw an objective of the best plan over time; the dashed line is the proven bound, or the best known value."""
    for colour, (method, result) in zip(COLOURS, results.items(), strict=False):
        times = [max(point.time_s, 1e-3) for point in result.trace]
        values = [getattr(point, field) for point in result.trace]
        axes.step([*times, SECONDS], [*values, values[-1]], where="post", color=colour, lw=1.8, label=method)
    axes.axhline(bound, color="#555555", lw=1, ls="--")
    axes.set(xscale="log", xlim=(1e-3, SECONDS), ylabel=label)
    axes.grid(alpha=0.25)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw(results: dict[str, Result], best: Result, path: Path) -> None:
    """Draw the plan of the first method, and the progress of all."""
    figure = Figure(figsize=(9, 3.9), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.25))
    draw_plan(figure.add_subplot(grid[:, 0]), next(iter(results.values())))
    upper, lower = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    draw_course(upper, results, "makespan", best.lower_bound, "makespan (h)")
    draw_course(lower, results, "energy", best.energy, "energy")
    upper.set_ylim(0.99, 1.08)
    lower.set_ylim(10, 30)
    upper.tick_params(labelbottom=False)
    lower.set_xlabel("seconds")
    upper.legend(loc="upper right", fontsize=9, frameon=False)
    figure.savefig(path, dpi=110)
    reduce_colours(path)


def main() -> None:
    """Solve the instance by all methods, and draw the results."""
    FOLDER.mkdir(exist_ok=True)
    problem = instance()
    found = {
        method: solve(problem, method, objective="makespan-energy", time_limit_s=SECONDS, threads=1)
        for method in METHODS
    }
    single = {method: {method: found[method]} for method in METHODS if method not in TOGETHER}
    for name, results in {**single, "ppo": {method: found[method] for method in TOGETHER}}.items():
        draw(results, found["milp"], FOLDER / f"{name}.png")


if __name__ == "__main__":
    main()
