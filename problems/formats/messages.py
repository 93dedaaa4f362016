"""Formatting of values, names and errors for one-line messages."""

import os
from pathlib import Path

from alloc.problems.errors import InputError

LONGEST_NAME = 40
LONGEST_MESSAGE = 300


def described(value: object) -> str:
    """Return a description of a JSON value in at most about 50 characters."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, int):
        return str(value) if abs(value) < 10**20 else "a number of too many digits"
    if isinstance(value, float):
        return {"nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}.get(f"{value:.12g}", f"{value:.12g}")
    kinds = {list: "a list", tuple: "a list", dict: "an object"}
    return next((words for kind, words in kinds.items() if isinstance(value, kind)), f"a {type(value).__name__}")


def quoted(text: str) -> str:
    """Return `text` in quotes, with control characters escaped, and cut if it is long."""
    return repr(text if len(text) <= LONGEST_NAME else text[: LONGEST_NAME - 3] + "...")


def message_line(text: str, longest: int = LONGEST_MESSAGE) -> str:
    """Return `text` without line breaks and other control characters, with its middle cut out if it is long."""
    if len(text) > longest:
        text = f"{text[: longest - 100]} ... {text[-90:]}"
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def told(error: InputError, source: str) -> InputError:
    """Return the error with its source, as a one-line message."""
    place = message_line(error.place, 100 + LONGEST_NAME)
    return InputError(message_line(error.message), place, message_line(error.source or source, 4096))


def reason(error: Exception) -> str:
    """Return the text of a system error, for use after a colon."""
    words = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return message_line(words[0].lower() + words[1:])


def unwritable(error: OSError | ValueError, path: str | os.PathLike[str], source: str = "") -> InputError:
    """Return an error that says why a file or folder cannot be written, and how to correct it.

    Parameters
    ----------
    error : OSError or ValueError
    path : str or path
        The target.
    source : str
        Name of the target in messages.
    """
    if isinstance(error, InputError):
        return error
    folder = Path(path).parent
    problem = reason(error)
    if isinstance(error, NotADirectoryError):
        file = next((parent for parent in (folder, *folder.parents) if parent.is_file()), folder)
        problem = f"{quoted(str(file))} is a file, not a folder; name another place"
    elif isinstance(error, FileNotFoundError) and folder.is_dir():
        problem = f"no files can be created in {quoted(str(folder))}; name another folder"
    elif isinstance(error, FileNotFoundError):
        problem = f"there is no folder {message_line(str(folder))!r}; create it first"
    return InputError(f"cannot be written: {problem}", source=source)
