from hypothesis import given
from hypothesis import strategies as st

from alloc.problems.models.names import LONGEST, plain_names


@given(st.lists(st.text(alphabet="ab_ é1", min_size=1, max_size=6), unique=True, max_size=20))
def test_names_are_unique_and_valid(ids: list[str]) -> None:
    """Names are unique and have no double underscore; an id that is a valid name is kept."""
    names = plain_names(ids, "agent")
    assert len(set(names)) == len(ids)
    assert all(name.isascii() and name.replace("_", "a").isalnum() and "__" not in name for name in names)
    for own, name in zip(ids, names, strict=True):
        is_plain = own.isascii() and own.replace("_", "a").isalnum() and own.strip("_") == own and "__" not in own
        assert (own == name) or not is_plain


def test_long_ids_are_shortened() -> None:
    """Long ids with equal beginnings have short and different names."""
    names = plain_names(["a" * 300, "a" * 301, "a" * 40], "agent")
    assert names[2] == "a" * LONGEST
    assert len(set(names)) == 3
    assert max(map(len, names)) < LONGEST + 5
