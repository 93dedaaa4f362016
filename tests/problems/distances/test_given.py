"""Tables of distances, by rows and by columns."""

import numpy as np
import pytest

from alloc.problems import DistanceTable, InputError

AGENTS, TASKS = ("a1", "a2", "x"), ("t1", "t2", "x")
ROWS = [("a1", "t1", 3.0), ("t1", "a1", 4.0), ("t2", "t1", 0.5)]


def test_row_and_column_forms_give_the_same_table() -> None:
    """Agents are nodes from 0 on, followed by tasks, in both forms of tables; arrays are read-only."""
    source, target, distance = zip(*ROWS, strict=True)
    for table in (
        DistanceTable.of(ROWS, AGENTS, TASKS, missing="unreachable"),
        DistanceTable.from_columns(source, target, np.array(distance), AGENTS, TASKS, missing="unreachable"),
    ):
        assert (table.n, table.m, table.missing) == (3, 3, "unreachable")
        assert (table.source.tolist(), table.target.tolist()) == ([0, 3, 4], [3, 0, 3])
        assert table.distance.tolist() == [3, 4, 0.5]
        assert not any(array.flags.writeable for array in (table.source, table.target, table.distance))


def test_empty_table_is_valid() -> None:
    """A table without rows is valid, and makes all tasks unreachable if it says so."""
    table = DistanceTable.from_columns([], [], np.zeros(0), AGENTS, TASKS, missing="unreachable")
    assert (len(table.source), len(table.target), len(table.distance)) == (0, 0, 0)


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([*ROWS, ("a3", "t1", 1)], r"distances\.rows\[3\]\[0\]: there is no agent or task 'a3'"),
        ([*ROWS, ("a2", "x", 1)], r"distances\.rows\[3\]\[1\]: 'x' is the id of an agent and of a task"),
        ([*ROWS, ("a2", "a1", 1)], r"distances\.rows\[3\]: joins two agents"),
        ([*ROWS, ("t2", "t1", 1)], r"distances\.rows\[3\]: gives a pair that an earlier row gives"),
        ([*ROWS, ("a2", "t1", -1)], r"distances\.rows\[3\]: must have a distance that is a finite number >= 0"),
        ([*ROWS, ("a2", "t1")], r"distances\.rows\[3\]: must be \[from, to, distance\] with two ids"),
    ],
)
def test_invalid_rows_are_located(rows: list[tuple[str, str, float]], message: str) -> None:
    """The error for the first invalid row has its number and, for an invalid id, the column."""
    with pytest.raises(InputError, match=message):
        DistanceTable.of(rows, AGENTS, TASKS)
