"""Exceptions of the package; their messages are one line that says what to correct."""

import difflib
from collections.abc import Sequence
from itertools import islice

MAX_NAMES = 10
"""Maximum number of known names that an error message lists."""

MAX_COMPARED, LONGEST_COMPARED = 1000, 60
"""Limits on the number and the length of names that are compared with an unknown one, as comparison is slow."""


class AllocError(Exception):
    """Base class of all errors that are raised on purpose; any other exception is a defect, or from a plugin."""


class InputError(AllocError, ValueError):
    """Input that breaks the rules of the problem, of a file format or of a parameter.

    Parameters
    ----------
    message : str
        What is wrong and how to correct it, without the source.
    place : str, optional
        The parameter, such as ``time_limit_s``, or the place in the data, such as ``agents[3].ability``.
    source : str, optional
        The file, or ``standard input``; filled in by the readers.
    """

    def __init__(self, message: str, place: str = "", source: str = "") -> None:
        self.message, self.place, self.source = message, place, source
        super().__init__(": ".join(part for part in (source, place, message) if part))


class MissingPackageError(InputError, ImportError):
    """A feature needs a package that is not installed; the message names it."""


class RefusedError(AllocError, ValueError):
    """A method refuses an instance before the run, and says why."""


class TrainingError(AllocError, RuntimeError):
    """Training cannot continue, for a reason other than its input."""


def closest(name: str, known: Sequence[str]) -> str | None:
    """Return the known name that is most similar to `name`; None if none is similar."""
    options = [option for option in islice(known, MAX_COMPARED) if len(option) <= LONGEST_COMPARED]
    close = difflib.get_close_matches(name[:LONGEST_COMPARED], options, n=1)
    if not close:  # names that differ only in case are similar
        folded = {option.casefold(): option for option in reversed(options)}
        close = [folded[key] for key in difflib.get_close_matches(name[:LONGEST_COMPARED].casefold(), folded, n=1)]
    return close[0] if close else None


def nearest(name: str, known: Sequence[str]) -> str:
    """Return a hint such as `` (did you mean 'speed'?)``, or a list of the known names if none is similar."""
    close = closest(name, known)
    if close is not None:
        return f" (did you mean {close!r}?)"
    if not known:
        return ""
    more = f" and {len(known) - MAX_NAMES} more" if len(known) > MAX_NAMES else ""
    return f" (known: {', '.join(known[:MAX_NAMES])}{more})"


def of_these(name: str, known: Sequence[str]) -> str:
    """Return the end of a message about an unknown name: the most similar name, if any, and all known names."""
    close = closest(name, known)
    hint = "" if close is None else f" (did you mean {close!r}?)"
    return f"{hint}; known are {', '.join(known)}" if known else ""
