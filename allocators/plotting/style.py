"""Settings that all drawings share: figure, fonts, suppressed warnings, and how files are written."""

import io
import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")

FONTS = (
    "DejaVu Sans",
    "Noto Sans CJK JP",
    "Noto Sans CJK SC",
    "Source Han Sans",
    "WenQuanYi Zen Hei",
    "Hiragino Sans",
    "Yu Gothic",
    "Microsoft YaHei",
    "Malgun Gothic",
    "Arial Unicode MS",
    "Unifont",
)
"""Font fallbacks: a glyph comes from the first installed one that has it; the first is shipped with matplotlib."""

DATES = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Left out of files, so that the same drawing gives the same file."""

SUPPRESSED = r"Glyph .* missing|Matplotlib currently does not support|constrained_layout not applied"
"""Warnings that a user can do nothing about: a missing glyph is drawn as a box, a crowded layout stays crowded."""


def check_plot(path: str) -> None:
    """Raise an `InputError` if the suffix of `path` is not one that drawings have."""
    from alloc.problems import InputError

    if Path(path).suffix.lower() not in SUFFIXES:
        *most, last = SUFFIXES
        raise InputError(f"must end in {', '.join(most)} or {last}", source=path)


def drawn(draw: Callable[[], "Figure"], path: str | None) -> "Figure":
    """Return the figure that `draw` makes, and write it to `path` if there is one."""
    if path is not None:
        check_plot(path)
    with in_style():
        figure = draw()
        if path is not None:
            _save(figure, path)
    return figure


@contextmanager
def in_style() -> Iterator[None]:
    """Draw inside with fonts for all scripts, and without output of matplotlib on standard error."""
    logger = logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.ERROR)  # it reports folders that it cannot write to, from its import on
    try:
        import matplotlib
        from matplotlib.font_manager import fontManager

        installed = {font.name for font in fontManager.ttflist}
        fonts = [name for name in FONTS if name in installed]
        with warnings.catch_warnings(), matplotlib.rc_context({"font.family": fonts or ["sans-serif"]}):
            warnings.filterwarnings("ignore", SUPPRESSED, UserWarning)
            yield
    finally:
        logger.setLevel(level)


def new_figure(width: float, height: float) -> "Figure":
    """Return a figure of this size in inches, on a canvas of its own."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: "Figure", path: str) -> None:
    from alloc.problems.formats import write_bytes_atomically

    kind = Path(path).suffix.lower().removeprefix(".")
    picture = io.BytesIO()
    figure.savefig(picture, format=kind, dpi=150, metadata=DATES.get(kind))
    write_bytes_atomically(path, picture.getvalue())
