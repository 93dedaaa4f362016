"""Colours of plots, distinguishable with any kind of colour vision, and in greyscale."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap
    from numpy.typing import NDArray

    from alloc.allocators import Result
    from alloc.problems.instance import FloatArray

UNSERVED, MAKESPAN, LIMIT = "#d55e00", "#d55e00", "#56b4e9"
"""From the palette of Okabe and Ito."""
MOVE = "#56606b"

NEGLIGIBLE = 1e-3
"""Relative difference of completion times up to which tasks are not coloured by time."""


def scale() -> "ListedColormap":
    """Return the colour map of completion times, with late times dark: cividis without its two ends."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap

    return ListedColormap(colormaps["cividis_r"](np.linspace(0.12, 0.88, 256)), name="completion")


def colour_range(result: "Result") -> tuple[float, float]:
    """Return the earliest and the latest completion time, at least a tenth of the makespan apart."""
    low, high = _busy_range(result)
    return (min(low, 0.9 * high), high) if high else (0.0, 1.0)


def _busy_range(result: "Result") -> tuple[float, float]:
    """Return the earliest and the latest completion time of tasks with work; zeros if there is none."""
    time = finite_times(result)
    busy = time[time > 0]
    return (float(busy.min()), float(busy.max())) if len(busy) else (0.0, 0.0)


def is_late_coloured(result: "Result") -> bool:
    """Return whether completion times differ by more than 0.1 %, so that colours are informative."""
    low, high = _busy_range(result)
    return high - low > NEGLIGIBLE * high


def shades(result: "Result") -> "FloatArray":
    """Return the position of each task on the colour map, from 0 (early) to 1 (late), shape (m,); 0 if unserved."""
    low, high = colour_range(result)
    time = finite_times(result)
    return np.clip((time - low) / (high - low), 0.0, 1.0)


def colours(result: "Result") -> "FloatArray":
    """Return the colour of each task, shape (m, 4)."""
    rgba: FloatArray = np.asarray(scale()(shades(result)), dtype=np.float64)
    return rgba


def finite_times(result: "Result") -> "FloatArray":
    """Return completion times, 0 if unserved, shape (m,)."""
    if result.evaluation is None:
        return np.zeros(result.instance.m)
    time = result.evaluation.completion_time
    return np.where(np.isinf(time), 0.0, time)


def unserved_tasks(result: "Result") -> "NDArray[np.bool_]":
    """Return which tasks are unserved, shape (m,)."""
    marked = np.zeros(result.instance.m, dtype=bool)
    if result.evaluation is not None:
        marked[list(result.evaluation.unserved_tasks)] = True
    return marked
