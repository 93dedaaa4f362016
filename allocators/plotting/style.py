"""The one way to draw: figures, their fonts and the warnings that a picture is not worth, and how they are written."""

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg")

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
"""A letter is taken from the first of these that is installed and has it; the first comes with matplotlib."""

UNTOLD = r"Glyph .* missing|Matplotlib currently does not support|constrained_layout not applied"
"""Warnings that nobody can do anything about: a box stands for a letter, and things lie closer than they should."""


def check_plot(path: str) -> None:
    """Raise an `InputError` if no drawing is written under that name."""
    from alloc.problems import InputError

    if Path(path).suffix.lower() not in SUFFIXES:
        raise InputError(f"must end in {' or '.join(SUFFIXES)}", source=path)


@contextmanager
def drawing() -> Iterator[None]:
    """Draw within: letters of all scripts, and not a word of matplotlib's on standard error."""
    logger = logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.ERROR)  # it tells of folders that it may not write, from its import on
    try:
        import matplotlib
        from matplotlib.font_manager import fontManager

        installed = {font.name for font in fontManager.ttflist}
        fonts = [name for name in FONTS if name in installed]
        with warnings.catch_warnings(), matplotlib.rc_context({"font.family": fonts or ["sans-serif"]}):
            warnings.filterwarnings("ignore", UNTOLD, UserWarning)
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


def save_figure(figure: "Figure", path: str) -> None:
    """Write `figure` into a .png or .svg file, whole or not at all."""
    from alloc.problems.formats import write_bytes_atomically

    kind = Path(path).suffix.lower().removeprefix(".")
    picture = io.BytesIO()
    figure.savefig(picture, format=kind, dpi=150, metadata={"Date": None} if kind == "svg" else None)
    write_bytes_atomically(path, picture.getvalue())
