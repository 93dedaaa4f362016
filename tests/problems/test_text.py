"""Names and numbers as text."""

import pytest

from alloc.problems.text import heading, labelled, number, short_names


@pytest.mark.parametrize(
    ("names", "short"),
    [
        (["abc", "abcdefghij"], ["abc", "abcdefghij"]),
        (["abcdefghijk"], ["abcdefghi…"]),
        (["pylon number 1", "pylon number 2"], ["pylon…er 1", "pylon…er 2"]),
        (["a\nb"], ["a b"]),
        (["same name twice", "same name twice"], ["same name…", "same name…"]),
    ],
)
def test_shortened_names_remain_distinct(names: list[str], short: list[str]) -> None:
    """At the end, or in the middle where the ends would be equal; equal names stay equal."""
    assert short_names(names, 10) == short


def test_names_that_differ_only_in_the_middle_are_numbered() -> None:
    """Names that differ at neither end get numbers, within the length limit."""
    names = [f"{'x' * 30}{letter}{'x' * 30}" for letter in "abc"]
    short = short_names(names, 10)
    assert len(set(short)) == 3
    assert all(len(name) <= 10 for name in short)


def test_missing_units_are_left_out() -> None:
    """A number or a heading alone, or with the unit."""
    assert (labelled("1", ""), labelled("1", "h")) == ("1", "1 h")
    assert (heading("finish", ""), heading("finish", "h")) == ("finish", "finish (h)")


@pytest.mark.parametrize(
    ("value", "text"),
    [(1714.2, "1714"), (-12345.6, "-12346"), (0.0012345, "0.00123"), (12.345, "12.3"), (2.5e7, "2.5e+07"), (None, "-")],
)
def test_numbers_are_written_without_an_exponent(value: float | None, text: str) -> None:
    """Numbers up to ten million have no exponent; larger ones do."""
    assert number(value, 3) == text
