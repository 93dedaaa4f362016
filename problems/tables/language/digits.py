"""Numbers in texts, with decimal commas or points, digit groups, and units."""

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal

from alloc.problems.tables.language.synonyms import words

Mark = Literal[",", "."]

NUMBER = re.compile(r"^([+-]?(?:\d[\d.,]*|[.,]\d+)(?:e[+-]?\d+)?)(?![\d.,])\s*(.*)$", re.IGNORECASE | re.DOTALL)
GROUPED = re.compile(r"^([+-]?\d{1,3}(?:[ \u00a0\u2009\u202f'\u2019]\d{3})+)(?![ \u00a0\u2009\u202f'\u2019]?\d)")
MINUS = str.maketrans({"\u2212": "-", "\u2013": "-"})
ABSENT = words(
    "-, --, \u2013, \u2014, ?, ., n/a, na, n.a., n. a., nan, none, null, nil, tbd, k.a., k. a., keine, "
    "unlimited, no limit, unbegrenzt, illimit\u00e9, ilimitado, inf, infinity, \u221e"
)
"""Texts that mean a missing number, or no limit."""


REMEMBERED = 1 << 16
"""Size of the cache of parsed texts, as columns repeat numbers and each is parsed several times."""


def is_absent(text: str) -> bool:
    """Return whether a text means a missing number, or no limit."""
    return text.casefold() in ABSENT


@lru_cache(REMEMBERED)
def split_number(text: str) -> tuple[str, str] | None:
    """Return the digits of a number with their marks, and the text after them; None if there is no number."""
    text = text.translate(MINUS)
    groups = GROUPED.match(text)
    if groups:
        plain = re.sub(r"[^\d+-]", "", groups[1])
        rest = text[groups.end() :]
        found = NUMBER.match(plain + rest)
        # with digits grouped by blanks, any other mark is the decimal mark
        if found and found[1][len(plain) : len(plain) + 1] in ("", ",", ".", "e", "E"):
            tail = found[1][len(plain) :]
            return plain + (tail + "e0" if tail[:1] in (",", ".") and "e" not in tail.lower() else tail), found[2]
        return None
    found = NUMBER.match(text)
    return (found[1], found[2].strip()) if found else None


@lru_cache(REMEMBERED)
def mark_of(digits: str) -> str:
    """Return the decimal mark of a number, ``?,`` or ``?.`` if it may also separate digit groups, ``""`` for none.

    ``!`` stands for an invalid number.
    """
    body = digits.lower().lstrip("+-")
    mantissa, exponent, _ = body.partition("e")
    marks = re.sub(r"\d", "", mantissa)
    if not marks:
        return ""
    last = marks[-1]
    if len(set(marks)) == 2:
        other = "," if last == "." else "."
        is_grouped = re.fullmatch(r"\d{1,3}(?:\D\d{3})+", mantissa[: mantissa.rindex(last)]) is not None
        return last if marks.count(last) == 1 and is_grouped and other in marks else "!"
    if len(marks) > 1:
        return ("," if last == "." else ".") if re.fullmatch(r"[1-9]\d{0,2}(?:\D\d{3})+", mantissa) else "!"
    head, tail = mantissa.split(last)
    is_decimal = bool(exponent) or len(tail) != 3 or not 1 <= len(head) <= 3 or head.startswith("0")
    return last if is_decimal else f"?{last}"


def number_of(digits: str, mark: Mark) -> float:
    """Return the value of a number with this decimal mark."""
    group = "." if mark == "," else ","
    return float(digits.replace(group, "").replace(mark, "."))


def decimal_marks(numbers: Iterable[str]) -> set[Mark]:
    """Return the unambiguous decimal marks of some numbers."""
    found = {mark_of(digits) for digits in numbers}
    return {mark for mark in (",", ".") if mark in found}
