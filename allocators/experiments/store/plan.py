"""Encoding of plans in a store: the task of each agent as a 4-byte integer, compressed."""

import zlib

import numpy as np

from alloc.problems import Allocation, InputError

LEVEL = 1
"""Compression level; higher ones take ten times as long to save a tenth."""


def packed(allocation: Allocation) -> bytes:
    """Return a plan as bytes."""
    return zlib.compress(allocation.task_of_agent.astype("<i4").tobytes(), LEVEL)


def unpacked(plan: bytes) -> Allocation:
    """Return the plan in the bytes of `packed`.

    Raises
    ------
    InputError
        If they are damaged.
    """
    try:
        return Allocation(np.frombuffer(zlib.decompress(plan), dtype="<i4"))
    except (zlib.error, ValueError) as error:
        raise InputError("is damaged", "plan") from error
