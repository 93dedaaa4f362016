"""Settings shared by all plots: figure, fonts, suppressed warnings, and writing of files."""

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
"""Font fallbacks: each glyph is taken from the first installed font that has it; the first is part of matplotlib."""

DATES = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata that is left out of files, so that the same figure gives the same file."""

SUPPRESSED = r"Glyph .* missing|Matplotlib currently does not support|constrained_layout not applied"
"""Warnings that users cannot act on: missing glyphs are drawn as boxes, and crowded layouts stay crowded."""


def check_plot(path: str) -> None:
    """Raise an `InputError` if the suffix of `path` is not that of a plot."""
    from alloc.problems import InputError

    if Path(path).suffix.lower() not in SUFFIXES:
        *most, last = SUFFIXES
        raise InputError(f"must end in {', '.join(most)} or {last}", source=path)


def drawn(draw: Callable[[], "Figure"], path: str | None) -> "Figure":
    """Return the figure that `draw` creates, and write it to `path` if given."""
    if path is not None:
        check_plot(path)
    with in_style():
        figure = draw()
        if path is not None:
            _save(figure, path)
    return figure


@contextmanager
def in_style() -> Iterator[None]:
    """Use fonts for all scripts in the block, and suppress output of matplotlib on standard error."""
    logger = logging.getLogger("matplotlib")
    level = logger.level
    logger.setLevel(logging.ERROR)  # on import, it already reports folders that are not writable
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
    """Return a figure of this size in inches, with its own canvas."""
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
