"""What the compiled loops of the network are made of: numbers in single precision, clipping and linear layers."""

from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.runtime.compiled import compiled_fast_math, inlined
from alloc.problems.game.features import FEATURE_LIMIT

Floats = NDArray[np.float32]
Ints = NDArray[np.int32]
Flags = NDArray[np.bool_]

F = cast(Callable[[float], float], np.float32)  # to mypy, as to the loops, its numbers are floats like others


@inlined
def clip(x: float) -> float:
    """Clip a feature to its limit."""
    return min(max(x, F(-FEATURE_LIMIT)), F(FEATURE_LIMIT))


@inlined
def clip_to_one(x: float) -> float:
    """Clip to [-1, 1]."""
    return min(max(x, F(-1.0)), F(1.0))


@inlined
def positive(x: float) -> float:
    """Return x where it is positive, else 0."""
    return max(x, F(0.0))


@compiled_fast_math
def linear(x: Floats, weights: Floats, out: Floats, rectify: bool) -> None:
    """Fill `out` with the product of the inputs and the weights, plus the bias; rectified if wanted.

    Parameters
    ----------
    x : ndarray, shape (inputs,)
    weights : ndarray, shape (inputs + 1, outputs)
    out : ndarray, shape (outputs,)
    rectify : bool
    """
    inputs, width = weights.shape[0] - 1, weights.shape[1]
    for k in range(width):
        out[k] = weights[inputs, k]
    for j in range(inputs):
        factor = x[j]
        for k in range(width):
            out[k] += factor * weights[j, k]
    if rectify:
        for k in range(width):
            out[k] = positive(out[k])
