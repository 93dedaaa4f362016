"""Random integers for compiled code, by xorshift."""

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled

RandomState = NDArray[np.uint64]
"""State of the generator, shape (1,)."""


@compiled
def draw(state: RandomState, below: int) -> int:
    """Return a random integer in [0, below), by xorshift (Marsaglia 2003, doi:10.18637/jss.v008.i14).

    Parameters
    ----------
    state : ndarray of uint64, shape (1,)
        Never 0; changed in place.
    below : int
        From 1 to 2**32.
    """
    x = state[0]
    x ^= x << np.uint64(13)
    x ^= x >> np.uint64(7)
    x ^= x << np.uint64(17)
    state[0] = x
    return np.int64(((x >> np.uint64(32)) * np.uint64(below)) >> np.uint64(32))  # type: ignore[return-value]
