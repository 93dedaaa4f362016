"""Numbers and names as text for people: in summaries, tables and drawings."""

from collections.abc import Sequence

WRITTEN_OUT = 1e7
"""Numbers below which whole ones are told by all their digits."""


def one_line(text: str) -> str:
    """Return `text` with line breaks and control characters replaced by blanks."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def number(value: float | None, digits: int = 6) -> str:
    """Return `value` with this many significant digits, a dash for None; below ten millions without an exponent."""
    if value is None:
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < WRITTEN_OUT else text


def counted(count: int, noun: str) -> str:
    """Return a number of things: ``1 task``, ``2 tasks``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def percent(share: float | None) -> str:
    """Return a share of one in per cent; a dash for None."""
    if share is None:
        return "-"
    return "0 %" if share < 5e-7 else f"{100 * share:.{2 if share < 0.1 else 3}g} %"


def labelled(value: str, unit: str) -> str:
    """Return a number with its unit behind it, if it has one."""
    return f"{value} {unit}" if unit else value


def heading(name: str, unit: str) -> str:
    """Return the heading of a column or an axis, with its unit in brackets, if it has one."""
    return f"{name} ({unit})" if unit else name


def short_names(names: Sequence[str], longest: int) -> list[str]:
    """Return the names on one line each, cut to `longest` characters; names that differ stay different.

    A name is cut at its end; where that makes it another's, in its middle, and where that does not help, it is
    numbered.
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
    """Return the name with its middle left out, after `head` characters, if it is too long."""
    return name if len(name) <= longest else name[:head] + "…" + name[len(name) - (longest - 1 - head) :]


def _shared(whole: Sequence[str], found: Sequence[str]) -> set[str]:
    """Return the names whose short form is that of another name too."""
    owners: dict[str, set[str]] = {}
    for name, short in zip(whole, found, strict=True):
        owners.setdefault(short, set()).add(name)
    return set().union(*(names for names in owners.values() if len(names) > 1))
