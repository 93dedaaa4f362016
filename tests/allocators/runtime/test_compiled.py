"""Loops are compiled once for all callers, whatever constants and integers these call them with."""

import numpy as np

from alloc.allocators.runtime.compiled import compiled


@compiled
def added(start, step):
    return start + step


@compiled
def total(steps):
    found = 0
    for step in steps:
        found = added(found, step)
    return added(found, 10)


def test_constants_and_small_integers_share_what_is_compiled():
    """A variable that is 0 at first, a constant, and integers of 32 bits: one function does for all, with their sum."""
    assert total(np.array([1, 2], dtype=np.int32)) == 13
    assert total(np.array([2**40, -1])) == 2**40 + 9
    assert [str(one) for one in added.signatures] in ([], ["(int64, int64)"])  # none where `total` is cached
