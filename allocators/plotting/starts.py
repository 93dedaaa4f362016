"""Marks of starts and bases: squares for several agents, dots for a single one, diamonds for bases to return to."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.places import Base, Places
from alloc.allocators.plotting.colours import MOVE
from alloc.problems import IDLE
from alloc.problems.text import short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from alloc.allocators import Result
    from alloc.problems.instance import FloatArray, IntArray

MAX_NAMES = 40
"""Number of bases above which they are not labelled."""

FEW_AGENTS = 15
"""Fleet size up to which bases without a name are labelled with the ids of their agents."""

LONGEST_NAME = 18
"""Maximum number of characters of a label."""


def draw_starts(axes: "Axes", result: "Result", begin: list[Base]) -> "FloatArray":
    """Draw the bases, hollow if all their agents are idle; return their sizes in points, shape (k,)."""
    size = sizes(result, begin)
    if not begin:
        return size
    place, idle = np.array([base.place for base in begin]), np.array([is_idle(result, base) for base in begin])
    count = np.array([len(base.agents) for base in begin])
    for shape, kind in (("o", count == 1), ("s", count > 1), ("D", count == 0)):
        for marked, face, edge in ((kind & ~idle, MOVE, "white"), (kind & idle, "none", MOVE)):
            x, y = place[marked].T
            area = size[marked] ** 2
            axes.scatter(x, y, s=area, marker=shape, facecolors=face, edgecolors=edge, linewidths=0.7, zorder=2)
    return size


def draw_returns(axes: "Axes", result: "Result", where: Places, agents: "IntArray") -> "FloatArray":
    """Draw a dashed line from the task of each of `agents` to its base; return their ends, shape (k, 2, 2)."""
    from matplotlib.collections import LineCollection

    if result.allocation is None:
        return np.zeros((0, 2, 2))
    agents = agents[result.allocation.task_of_agent[agents] != IDLE]
    task, home = where.tasks[result.allocation.task_of_agent[agents]], where.home_of(result.instance, agents)
    flown = (home != where.starts[agents]).any(axis=1) & ~np.isnan(home[:, 0]) & ~np.isnan(task[:, 0])
    lines = np.unique(np.hstack([task, home])[flown & (home != task).any(axis=1)], axis=0).reshape(-1, 2, 2)
    alpha = float(np.clip(40 / max(len(lines), 1), 0.1, 0.7))
    axes.add_collection(
        LineCollection(list(lines), colors=MOVE, linewidths=0.9, linestyles=(0, (4, 3)), alpha=alpha, zorder=1)
    )
    return lines


def sizes(result: "Result", begin: list[Base]) -> "FloatArray":
    """Return the width of each mark in points: larger with more agents at the base, smaller with more bases."""
    largest = float(np.clip(36 / np.sqrt(max(len(begin), 1)), 2.0, 6.0))
    count = np.array([len(base.agents) for base in begin], dtype=np.float64)
    return np.minimum(largest * (0.9 + 0.1 * np.sqrt(count)), 2.5 * largest)


def start_names(result: "Result", begin: list[Base]) -> list[str]:
    """Return the label of each base: its name with the number of its agents, or the ids of few agents."""
    if len(begin) > MAX_NAMES:
        return []
    short = short_names([base.name for base in begin], LONGEST_NAME)
    names = []
    for base, name in zip(begin, short, strict=True):
        count = len(base.agents)
        if result.instance.n <= FEW_AGENTS and 1 <= count <= 3 and not base.is_named:
            names.append(", ".join(short_names([result.instance.agent_ids[i] for i in base.agents], LONGEST_NAME)))
        else:
            names.append(name if count <= 1 else f"{name} ({count})")
    return names


def is_idle(result: "Result", base: Base) -> bool:
    """Return whether the base has agents, all of which are idle."""
    if not len(base.agents):
        return False
    return result.allocation is None or bool((result.allocation.task_of_agent[base.agents] == IDLE).all())
