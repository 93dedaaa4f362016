"""The picture of a front: numbers on its axis."""

import pytest

from alloc.allocators.plotting.front import log_ticks


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [
        (1.18, 5.8, [1.5, 2, 3, 4, 5]),
        (0.9, 26, [1, 2, 5, 10, 20]),
        (0.9, 1.3e5, [1, 10, 100, 1000, 10_000, 100_000]),
        (2.1e4, 1.2e5, [30_000, 40_000, 50_000, 60_000, 80_000, 100_000]),
        (0.9, 1.3e9, [10, 1000, 1e5, 1e7, 1e9]),
    ],
)
def test_axis_ticks_are_round_and_few(low: float, high: float, ticks: list[float]) -> None:
    """A short axis has more than two ticks, a long one no more than fit."""
    assert log_ticks(low, high) == pytest.approx(ticks)
