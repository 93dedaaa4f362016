"""The random numbers of `alloc.problems.missions.chance`, compiled: the state of the hash after each part of a key."""

import numpy as np

from alloc.allocators.runtime.compiled import compiled_in_place

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@compiled_in_place
def keyed(state: int, part: int) -> int:
    """Return the state of the hash after another part of the key; `first_key` starts it."""
    value = (np.uint64(state) ^ np.uint64(part)) + _GOLDEN
    value = (value ^ (value >> _30)) * _FIRST
    value = (value ^ (value >> _27)) * _SECOND
    return np.int64(value ^ (value >> _31))  # type: ignore[return-value]  # a plain int in compiled code


@compiled_in_place
def first_key(purpose: int) -> int:
    """Return the state of the hash after the first part of a key, the purpose of the number."""
    return keyed(np.int64(_GOLDEN), purpose)  # type: ignore[arg-type]


@compiled_in_place
def fraction(state: int) -> float:
    """Return the number in [0, 1) of a whole key."""
    return float(np.uint64(state) >> _11) * 2.0**-53
