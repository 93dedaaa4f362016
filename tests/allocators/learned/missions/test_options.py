"""Features of the options of an agent in a mission."""

import numba
import numpy as np
import pytest

from alloc.allocators.learned.missions.options import THIRDS, squashed, squashed_count

pytestmark = pytest.mark.slow  # the function is compiled first


@numba.njit
def of_count(count: int) -> np.float32:
    """Return the compiled `squashed_count`."""
    return squashed_count(count)


@pytest.mark.parametrize("count", [0, 1, 7, len(THIRDS) - 1, len(THIRDS), 1000])
def test_numbers_are_squashed_alike_with_and_without_the_table(count: int) -> None:
    """A number of agents or tasks becomes x / (3 + x), from the table or computed."""
    assert of_count(count) == np.float32(1 - 1 / (1 + count / 3))


def test_infinite_amounts_are_squashed_to_one() -> None:
    """A task without agents is never completed, which is 1."""
    assert squashed(np.inf, 0.5) == 1.0
    assert squashed(0.0, 0.5) == 0.0
