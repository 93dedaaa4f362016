"""A compiled event queue: a binary heap of items by hour."""

import numpy as np

from alloc.allocators.online.routes.situation import Records
from alloc.allocators.runtime.compiled import compiled_in_place, inlined

ENTRY = np.dtype([("hour", np.float64), ("item", np.int64), ("version", np.int64)])


@inlined
def _is_before(queue: Records, index: int, hour: float, item: int) -> bool:
    return bool(queue[index].hour < hour or (queue[index].hour == hour and queue[index].item <= item))


@inlined
def _copy(queue: Records, to: int, source: int) -> None:
    queue[to].hour, queue[to].item = queue[source].hour, queue[source].item
    queue[to].version = queue[source].version


@compiled_in_place
def push(queue: Records, size: int, hour: float, item: int, version: int) -> int:
    """Push an item; return the new size. At equal hours, smaller items come first."""
    child = size
    while child > 0:
        parent = (child - 1) >> 1
        if _is_before(queue, parent, hour, item):
            break
        _copy(queue, child, parent)
        child = parent
    queue[child].hour, queue[child].item, queue[child].version = hour, item, version
    return size + 1


@compiled_in_place
def drop_first(queue: Records, size: int) -> int:
    """Remove the first item; return the new size."""
    size -= 1
    hour, item = queue[size].hour, queue[size].item
    parent = 0
    while True:
        child = 2 * parent + 1
        if child >= size:
            break
        other = child + 1
        if other < size and _is_before(queue, other, queue[child].hour, queue[child].item):
            child = other
        if not _is_before(queue, child, hour, item):
            break
        _copy(queue, parent, child)
        parent = child
    _copy(queue, parent, size)
    return size
