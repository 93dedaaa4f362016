"""The plot of makespan and energy by size of the fleet."""

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING

from alloc.allocators.plotting.colours import LIMIT, MAKESPAN, MOVE
from alloc.allocators.plotting.sites import plain_text
from alloc.allocators.plotting.style import drawn, new_figure
from alloc.problems.text import counted, heading, shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from alloc.allocators.experiments.fleets import Fleet
    from alloc.allocators.experiments.whatif import WhatIf

MAX_LABELS = 12
"""Maximum number of fleets of which each is labelled below its bar."""


def plot_whatif(found: "WhatIf", path: str | None = None) -> "Figure":
    """Draw makespan and energy of each fleet with their proven bounds, and the number of unserved tasks, if any.

    Parameters
    ----------
    found : WhatIf
    path : str, optional
        A .png, .svg or .pdf file to write the figure to, atomically.

    Returns
    -------
    matplotlib.figure.Figure
        A figure with its own canvas; matplotlib's current figure is not changed.

    Raises
    ------
    InputError
        If `path` has another suffix or cannot be written.
    """
    return drawn(lambda: _draw(found), path)


def _draw(found: "WhatIf") -> "Figure":
    units, results = found.instance.units, [fleet.result for fleet in found.fleets]
    left = [float(result.unserved_count) for result in results]
    complete = [result for result in results if result.makespan is not None]
    parts = {"unserved": any(left), "makespan": bool(complete), "energy": any(result.energy for result in complete)}
    drawn_parts = [name for name, is_there in parts.items() if is_there] or ["makespan"]
    figure = new_figure(8, 2.2 + 2 * len(drawn_parts))
    axes = figure.subplots(len(drawn_parts), 1, sharex=True, squeeze=False)[:, 0]
    part = dict(zip(drawn_parts, axes, strict=True))
    if "unserved" in part:
        _bars(part["unserved"], left, [None] * len(left), MOVE)
        part["unserved"].yaxis.get_major_locator().set_params(integer=True)
        part["unserved"].set_ylabel("unserved tasks")
    if "makespan" in part:
        _bars(part["makespan"], [result.makespan for result in results], [result.lower_bound for result in results])
        part["makespan"].set_ylabel(plain_text(heading("makespan", units.time)))
        part["makespan"].legend(frameon=False, loc="upper right", ncols=3, fontsize=9)
    if "energy" in part:
        energy = [result.energy if result.makespan is not None else None for result in results]
        _bars(part["energy"], energy, [result.energy_lower_bound for result in results])
        part["energy"].set_ylabel(plain_text(heading("energy", units.energy)))
    _name(axes[-1], found.fleets)
    axes[0].set_title(_title(found), fontsize=10)
    return figure


def _bars(axes: "Axes", values: Sequence[float | None], bounds: Sequence[float | None], colour: str = MAKESPAN) -> None:
    """Draw a bar for each fleet, and its lower bound on top of it; none if tasks are unserved."""
    at = range(len(values))
    axes.bar(at, [value or 0.0 for value in values], color=colour, label="best found", width=0.7)
    if any(bound is not None for bound in bounds):
        axes.bar(at, [bound or 0.0 for bound in bounds], color=LIMIT, label="lower bound", width=0.7)
    axes.set_ylim(0, max((value or 0.0 for value in values), default=0.0) * 1.35 or 1.0)
    for place, value in enumerate(values):
        if value is not None and len(values) <= MAX_LABELS:
            axes.annotate(f"{value:.3g}", (place, value), (0, 2), textcoords="offset points", ha="center", fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)


def _name(axes: "Axes", fleets: Sequence["Fleet"]) -> None:
    """Label the bars with the numbers of agents of the fleets, and the changes."""
    step = -(-len(fleets) // MAX_LABELS)
    labels = [f"{fleet.result.instance.n}\n{_changed(fleet)}" for fleet in fleets]
    axes.set_xticks(range(0, len(fleets), step), labels[::step])
    axes.set_xlabel("agents")


def _changed(fleet: "Fleet") -> str:
    less, more = fleet.removed, f"+{len(fleet.added)}" if fleet.added else ""
    if not less:
        return more or "current"
    return f"−{plain_text(shortened(less[0], 12)) if len(less) == 1 else len(less)}{' ' + more if more else ''}"


def _title(found: "WhatIf") -> str:
    name = plain_text(shortened(found.instance.name, 60))
    size = f"{counted(found.instance.n, 'agent')}, {counted(found.instance.m, 'task')}"
    answer = shortened(found.answer, 260).replace(" %", "\N{NO-BREAK SPACE}%")
    return "\n".join([f"{name}: {size}", *map(plain_text, wrap(answer, 95))])
