"""Where agents begin: squares for bases with a name and a number of agents, dots for single agents."""

from typing import TYPE_CHECKING

import numpy as np

from alloc.allocators.plan.places import Base
from alloc.allocators.plotting.colours import MOVE
from alloc.problems import IDLE
from alloc.problems.text import short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from alloc.allocators import Result
    from alloc.problems.instance import FloatArray

MAX_NAMES = 40
"""Number of bases above which they are not named."""

FEW_AGENTS = 15
"""Number of agents of a fleet up to which they are named at bases without a name."""

LONGEST_NAME = 18
"""Characters of a name before it is shortened."""


def draw_starts(axes: "Axes", result: "Result", begin: list[Base]) -> "FloatArray":
    """Draw the bases that are not at tasks, hollow where all are idle; return their sizes in points, shape (k,)."""
    size = sizes(result, begin)
    if not begin:
        return size
    place, idle = np.array([base.place for base in begin]), np.array([is_idle(result, base) for base in begin])
    single = np.array([len(base.agents) == 1 for base in begin])
    for shape, kind in (("o", single), ("s", ~single)):
        for marked, face, edge in ((kind & ~idle, MOVE, "white"), (kind & idle, "none", MOVE)):
            x, y = place[marked].T
            area = size[marked] ** 2
            axes.scatter(x, y, s=area, marker=shape, facecolors=face, edgecolors=edge, linewidths=0.7, zorder=2)
    return size


def sizes(result: "Result", begin: list[Base]) -> "FloatArray":
    """Return the width of each mark in points: it grows with the number of agents, and shrinks with that of bases."""
    largest = float(np.clip(36 / np.sqrt(max(len(begin), 1)), 2.0, 6.0))
    count = np.array([len(base.agents) for base in begin], dtype=np.float64)
    return np.minimum(largest * (0.9 + 0.1 * np.sqrt(count)), 2.5 * largest)


def start_names(result: "Result", begin: list[Base]) -> list[str]:
    """Return what is written beside each base: its name and how many agents begin there, or few agents."""
    if len(begin) > MAX_NAMES:
        return []
    short = short_names([base.name for base in begin], LONGEST_NAME)
    names = []
    for base, name in zip(begin, short, strict=True):
        count = len(base.agents)
        if result.instance.n <= FEW_AGENTS and count <= 3 and not base.is_named:
            names.append(", ".join(short_names([result.instance.agent_ids[i] for i in base.agents], LONGEST_NAME)))
        else:
            names.append(name if count == 1 else f"{name} ({count})")
    return names


def is_idle(result: "Result", base: Base) -> bool:
    """Return whether nobody who begins there has a task."""
    return result.allocation is None or bool((result.allocation.task_of_agent[base.agents] == IDLE).all())
