"""Errors about input, phrased so that one line tells what to mend."""

import difflib
from collections.abc import Iterable


class InputError(ValueError):
    """Input that breaks the rules of the problem or of a file format.

    Parameters
    ----------
    message : str
        What is wrong and what to do, without the source.
    place : str, optional
        Where in the source, such as ``agents[3].ability``.
    source : str, optional
        The file, or ``standard input``; filled in by the readers.
    """

    def __init__(self, message: str, place: str = "", source: str = "") -> None:
        self.message, self.place, self.source = message, place, source
        super().__init__(": ".join(part for part in (source, place, message) if part))

    def at(self, source: str, place: str | None = None) -> "InputError":
        """Return the same error, told of `source` (and of `place` where one is given)."""
        return InputError(self.message, self.place if place is None else place, self.source or source)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint such as `` (did you mean 'speed'?)``, or the known names where none is near."""
    options = sorted(known)
    close = difflib.get_close_matches(name, options, n=1)
    return f" (did you mean {close[0]!r}?)" if close else f" (known: {', '.join(options)})"
