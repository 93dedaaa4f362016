"""Plans as a store keeps them: the task of each agent as whole numbers of four bytes, compressed."""

import zlib

import numpy as np

from alloc.problems import Allocation, InputError

LEVEL = 1
"""Of the compression: higher ones take ten times as long for a tenth less."""


def packed(allocation: Allocation) -> bytes:
    """Return the bytes of a plan."""
    return zlib.compress(allocation.task_of_agent.astype("<i4").tobytes(), LEVEL)


def unpacked(plan: bytes) -> Allocation:
    """Return the plan in bytes that `packed` gave.

    Raises
    ------
    InputError
        If they are damaged.
    """
    try:
        return Allocation(np.frombuffer(zlib.decompress(plan), dtype="<i4"))
    except (zlib.error, ValueError) as error:
        raise InputError("is damaged", "plan") from error
