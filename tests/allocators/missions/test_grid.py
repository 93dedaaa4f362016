"""Distances compared without square roots."""

import math
import random

import pytest

from alloc.allocators.missions.grid import limit_of

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]  # loops are compiled first


@pytest.mark.parametrize("seed", range(20))
def test_squared_limit_decides_as_the_square_root_does(seed: int) -> None:
    """The limit is the last number whose rounded square root is within reach."""
    rng = random.Random(seed)
    reach = rng.choice([rng.random(), rng.random() + 1e-9, rng.uniform(1, 1e4), 10 ** rng.uniform(-8, 8)])
    limit = limit_of(0, reach)
    assert math.sqrt(limit) <= reach < math.sqrt(math.nextafter(limit, math.inf))


@pytest.mark.parametrize(("is_manhattan", "reach"), [(1, 0.3), (0, math.inf), (1, math.inf)])
def test_limit_is_the_reach_itself_where_nothing_is_squared(is_manhattan: int, reach: float) -> None:
    """Manhattan lengths are compared as they are, and without a limit everything is within reach."""
    assert limit_of(is_manhattan, reach) == reach
