"""The legend of a map."""

from typing import TYPE_CHECKING

from alloc.allocators.plan.places import Base
from alloc.allocators.plotting.colours import MOVE, UNSERVED
from alloc.allocators.plotting.starts import is_idle

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

    from alloc.allocators import Result


def draw_legend(axes: "Axes", result: "Result", begin: list[Base], *, counts: bool, moves: bool, returns: bool) -> None:
    """Draw a legend below the axes with the marks that occur in the drawing.

    Parameters
    ----------
    begin : list of Base
        The bases that are drawn.
    counts, moves, returns : bool
        Whether circles contain numbers of agents, whether moves are drawn, and whether returns to bases are drawn.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Polygon

    area = "task; area: workload, number: agents" if counts else "task; area: workload"
    entries: list[Artist] = [_mark("o", area, "#4d6a8f", 9)]
    if result.evaluation is not None and result.evaluation.unserved_tasks:
        entries.append(_mark("o", "unserved task", "white", 9, edge=UNSERVED))
    if any(len(base.agents) > 1 for base in begin):
        entries.append(_mark("s", "base (number of agents)", MOVE, 6))
    if any(len(base.agents) == 1 for base in begin):
        entries.append(_mark("o", "start of a single agent", MOVE, 5))
    if any(not len(base.agents) for base in begin):
        entries.append(_mark("D", "return base", MOVE, 5))
    if any(is_idle(result, base) for base in begin):
        entries.append(_mark("o", "start, all agents idle", "white", 5, edge=MOVE))
    if moves:
        entries.append(Polygon([(0, 0)], facecolor=MOVE, alpha=0.5, label="move, tapering to the task"))
    if returns:
        entries.append(Line2D([], [], color=MOVE, linewidth=0.9, linestyle=(0, (4, 3)), label="return flight"))
    axes.legend(
        handles=entries,
        handler_map={Polygon: _wedge_handler()},
        loc="upper center",
        bbox_to_anchor=(0.5, -0.11),
        ncols=3,
        frameon=False,
        fontsize=8,
    )


def _mark(shape: str, label: str, face: str, size: float, edge: str = "white") -> "Line2D":
    from matplotlib.lines import Line2D

    return Line2D(
        [], [], marker=shape, linestyle="", markersize=size, markerfacecolor=face, markeredgecolor=edge, label=label
    )


def _wedge_handler() -> object:
    """Return a legend handler that draws a wedge."""
    from matplotlib.legend_handler import HandlerPatch
    from matplotlib.patches import Polygon

    def wedge(*, xdescent: float, width: float, height: float, **_: object) -> "Artist":
        return Polygon([(-xdescent, 0.85 * height), (-xdescent, 0.15 * height), (width - xdescent, 0.5 * height)])

    return HandlerPatch(patch_func=wedge)
