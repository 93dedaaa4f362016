"""Errors that help to mend what is wrong."""

from alloc.problems.errors import nearest


def test_nearest_name_is_offered() -> None:
    """One that is near is enough; where none is, those that are known are listed."""
    assert nearest("spede", ["speed", "range"]) == " (did you mean 'speed'?)"
    assert nearest("xyz", ["speed", "range"]) == " (known: speed, range)"
    assert nearest("xyz", []) == ""
    assert nearest("ID", ["id", "ability"]) == " (did you mean 'id'?)"
    assert nearest("BATERY", ["id", "battery"]) == " (did you mean 'battery'?)"
    assert nearest("A", ["a", "A1"]) == " (did you mean 'A1'?)"


def test_long_lists_are_cut() -> None:
    """Of thousands of names a line holds ten, and says how many there are besides."""
    ids = [f"agent-{number}" for number in range(5000)]
    assert nearest("xyz", ids) == f" (known: {', '.join(ids[:10])} and 4990 more)"
    assert nearest("agnt-7", ids) == " (did you mean 'agent-7'?)"
