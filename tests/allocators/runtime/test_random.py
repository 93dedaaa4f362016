import numpy as np

from alloc.allocators.runtime.random import draw


def test_draws_are_uniform_and_reproducible():
    """Random numbers are uniform over their range, and equal for equal states."""
    state = np.array([12345], dtype=np.uint64)
    drawn = [draw(state, 7) for _ in range(7000)]
    assert np.bincount(drawn, minlength=7).min() > 850
    assert max(drawn) == 6
    state[0] = 12345
    assert [draw(state, 7) for _ in range(20)] == drawn[:20]
