"""Numbers and names as text for people: in summaries, tables and drawings."""


def one_line(text: str) -> str:
    """Return `text` with line breaks and control characters replaced by blanks."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def number(value: float | None, digits: int = 6) -> str:
    """Return `value` with this many significant digits; a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"


def counted(count: int, noun: str) -> str:
    """Return a number of things: ``1 task``, ``2 tasks``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def percent(share: float | None) -> str:
    """Return a share of one in per cent; a dash for None."""
    if share is None:
        return "-"
    return "0 %" if share < 5e-7 else f"{100 * share:.{2 if share < 0.1 else 3}g} %"
