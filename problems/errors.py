"""The family of errors, phrased so that one line tells what to mend."""

import difflib
from collections.abc import Sequence
from itertools import islice

MOST_NAMES = 10
"""Known names that an error lists at the most."""

MOST_COMPARED, LONGEST_COMPARED = 1000, 60
"""Known names that are compared with an unknown one, and characters of each: beyond, it would take seconds."""


class AllocError(Exception):
    """Base of all errors that are raised on purpose; anything else is a defect, or comes from a plugin."""


class InputError(AllocError, ValueError):
    """Input that breaks the rules of the problem, of a file format or of a parameter.

    Parameters
    ----------
    message : str
        What is wrong and what to do, without the source.
    place : str, optional
        The parameter, such as ``time_limit_s``, or where in the data, such as ``agents[3].ability``.
    source : str, optional
        The file, or ``standard input``; filled in by the readers.
    """

    def __init__(self, message: str, place: str = "", source: str = "") -> None:
        self.message, self.place, self.source = message, place, source
        super().__init__(": ".join(part for part in (source, place, message) if part))


class MissingPackageError(InputError, ImportError):
    """What is asked for needs a package that is not installed; the message says which."""


class RefusedError(AllocError, ValueError):
    """A method says beforehand that it cannot handle an instance, and why."""


class TrainingError(AllocError, RuntimeError):
    """A training cannot go on, through no fault of its input."""


def closest(name: str, known: Sequence[str]) -> str | None:
    """Return the known name that may be meant; None if none is near."""
    options = [option for option in islice(known, MOST_COMPARED) if len(option) <= LONGEST_COMPARED]
    close = difflib.get_close_matches(name[:LONGEST_COMPARED], options, n=1)
    if not close:  # capital letters alone make no other name
        folded = {option.casefold(): option for option in reversed(options)}
        close = [folded[key] for key in difflib.get_close_matches(name[:LONGEST_COMPARED].casefold(), folded, n=1)]
    return close[0] if close else None


def nearest(name: str, known: Sequence[str]) -> str:
    """Return a hint such as `` (did you mean 'speed'?)``, or of the known names if none is near."""
    close = closest(name, known)
    if close is not None:
        return f" (did you mean {close!r}?)"
    if not known:
        return ""
    more = f" and {len(known) - MOST_NAMES} more" if len(known) > MOST_NAMES else ""
    return f" (known: {', '.join(known[:MOST_NAMES])}{more})"


def of_these(name: str, known: Sequence[str]) -> str:
    """Return the end of a message on an unknown name: which one may be meant, and all that there are."""
    close = closest(name, known)
    hint = "" if close is None else f" (did you mean {close!r}?)"
    return f"{hint}; there are {', '.join(known)}" if known else ""
