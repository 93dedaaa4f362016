"""Formatting of numbers and names for summaries, tables and drawings."""

from collections.abc import Sequence

WRITTEN_OUT = 1e7
"""Number below which large numbers are written without an exponent."""


def one_line(text: str) -> str:
    """Return `text` with line breaks and control characters replaced by spaces."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def number(value: float | None, digits: int = 6) -> str:
    """Return `value` with `digits` significant digits, without an exponent below ten million; a dash for None."""
    if value is None:
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < WRITTEN_OUT else text


def counted(count: int, noun: str) -> str:
    """Return a count with its noun: ``1 task``, ``2 tasks``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def percent(share: float | None) -> str:
    """Return a fraction as a percentage; a dash for None."""
    if share is None:
        return "-"
    return "0 %" if share < 5e-7 else f"{100 * share:.{2 if share < 0.1 else 3}g} %"


def labelled(value: str, unit: str) -> str:
    """Return a number followed by its unit, if it has one."""
    return f"{value} {unit}" if unit else value


def heading(name: str, unit: str) -> str:
    """Return the heading of a column or an axis, followed by its unit in parentheses, if it has one."""
    return f"{name} ({unit})" if unit else name


def short_names(names: Sequence[str], longest: int) -> list[str]:
    """Return the names, each on one line and cut to `longest` characters, such that different names stay different.

    A name is cut at its end; if it then equals another, it is cut in the middle, and if that does not help, it gets
    a number.
    """
    whole = [one_line(name) for name in names]
    found = [_cut(name, longest, longest - 1) for name in whole]
    for head in range(longest // 2, 1, -longest // 4):
        shared = _shared(whole, found)
        found = [
            _cut(name, longest, head) if name in shared else short for name, short in zip(whole, found, strict=True)
        ]
    shared = _shared(whole, found)
    numbers = {name: f"…{number}" for number, name in enumerate(dict.fromkeys(whole), 1) if name in shared}
    return [
        short[: longest - len(numbers[name])] + numbers[name] if name in numbers else short
        for name, short in zip(whole, found, strict=True)
    ]


def shortened(name: str, longest: int) -> str:
    """Return a name on one line, cut to `longest` characters."""
    return short_names([name], longest)[0]


def _cut(name: str, longest: int, head: int) -> str:
    """Return the name, with its middle after `head` characters left out if it is too long."""
    return name if len(name) <= longest else name[:head] + "…" + name[len(name) - (longest - 1 - head) :]


def _shared(whole: Sequence[str], found: Sequence[str]) -> set[str]:
    """Return the names that share their short form with another name."""
    owners: dict[str, set[str]] = {}
    for name, short in zip(whole, found, strict=True):
        owners.setdefault(short, set()).add(name)
    return set().union(*(names for names in owners.values() if len(names) > 1))
