"""Damaged files are either read, or refused in one line."""

import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from alloc.problems import Allocation, InputError, Instance, read_allocation, read_instance
from alloc.problems.formats import write_allocation, write_instance

SPICE = [b"NaN", b"1e999", b"-1", b"null", b"[", b"]", b"{", b"}", b'"', b",", b"\n", b"\0", b"\xff", b"\\u0000", b""]
MUTATION = st.tuples(
    st.floats(0, 1, exclude_max=True),
    st.integers(0, 8),
    st.one_of(st.binary(max_size=4), st.sampled_from(SPICE)),
)


def damaged(data: bytes, mutations: list[tuple[float, int, bytes]]) -> bytes:
    """Replace a few bytes at each of some places, given as fractions of the length."""
    for fraction, removed, inserted in mutations:
        place = int(fraction * len(data))
        data = data[:place] + inserted + data[place + removed :]
    return data


TABLES = ["x/agents.csv", "x/tasks.csv", "x/distances.csv", "x/instance.json"]


@pytest.mark.parametrize("file", ["x.json", *TABLES, "x.npz", "plan.json"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(mutations=st.lists(MUTATION, min_size=1, max_size=4), is_varied=st.booleans())
def test_damaged_files_give_an_instance_or_one_error(
    full: Instance, varied: Instance, file: str, mutations: list[tuple[float, int, bytes]], is_varied: bool
) -> None:
    """A valid file with bytes replaced, removed and inserted gives an instance or one InputError of one line."""
    if is_varied or file == "x/distances.csv":
        full = varied
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        if file == "plan.json":
            write_allocation(Allocation([0, -1, 1]), full, path)
        else:
            write_instance(full, Path(folder) / file.partition("/")[0])
        path.write_bytes(damaged(path.read_bytes(), mutations))
        try:
            if file == "plan.json":
                read_allocation(path, full)
            else:
                assert read_instance(Path(folder) / file.partition("/")[0]).n > 0
        except InputError as error:
            text = str(error)
            assert text.isprintable()
            assert text.startswith(str(Path(folder) / file.partition("/")[0]))
            assert len(text) < 600


@settings(max_examples=100, deadline=None)
@given(cut=st.floats(0, 1, exclude_max=True), file=st.sampled_from(["x.json", "x.npz"]))
def test_truncated_files_are_refused(cut: float, file: str) -> None:
    """No prefix of a valid file is read as if it were complete."""
    instance = Instance(ability=[1, 2], workload=[3, 4], battery=[5, 6])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        write_instance(instance, path)
        data = path.read_bytes().rstrip()
        path.write_bytes(data[: int(cut * len(data))])
        with pytest.raises(InputError):
            read_instance(path)
