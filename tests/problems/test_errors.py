"""Helpful error messages."""

from alloc.problems.errors import nearest


def test_nearest_name_is_offered() -> None:
    """The most similar name is offered, or the known ones if none is similar."""
    assert nearest("spede", ["speed", "range"]) == " (did you mean 'speed'?)"
    assert nearest("xyz", ["speed", "range"]) == " (known: speed, range)"
    assert nearest("xyz", []) == ""
    assert nearest("ID", ["id", "ability"]) == " (did you mean 'id'?)"
    assert nearest("BATERY", ["id", "battery"]) == " (did you mean 'battery'?)"
    assert nearest("A", ["a", "A1"]) == " (did you mean 'A1'?)"


def test_long_lists_are_truncated() -> None:
    """Of thousands of names, ten are listed, with the number of the others."""
    ids = [f"agent-{number}" for number in range(5000)]
    assert nearest("xyz", ids) == f" (known: {', '.join(ids[:10])} and 4990 more)"
    assert nearest("agnt-7", ids) == " (did you mean 'agent-7'?)"
