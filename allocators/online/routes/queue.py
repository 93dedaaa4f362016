"""A compiled queue of what comes next: a heap of hours and items."""

from alloc.allocators.online.routes.situation import Floats, Ints
from alloc.allocators.runtime.compiled import compiled


@compiled
def push(hours: Floats, items: Ints, versions: Ints, size: int, hour: float, item: int, version: int) -> int:
    """Put an item into the queue; return its new size. At one hour smaller items come first."""
    child = size
    while child > 0:
        parent = (child - 1) >> 1
        if hours[parent] < hour or (hours[parent] == hour and items[parent] <= item):
            break
        hours[child], items[child], versions[child] = hours[parent], items[parent], versions[parent]
        child = parent
    hours[child], items[child], versions[child] = hour, item, version
    return size + 1


@compiled
def drop_first(hours: Floats, items: Ints, versions: Ints, size: int) -> int:
    """Take the first item out of the queue; return its new size."""
    size -= 1
    hour, item, version = hours[size], items[size], versions[size]
    parent = 0
    while True:
        child = 2 * parent + 1
        if child >= size:
            break
        other = child + 1
        if other < size and (
            hours[other] < hours[child] or (hours[other] == hours[child] and items[other] < items[child])
        ):
            child = other
        if hour < hours[child] or (hour == hours[child] and item <= items[child]):
            break
        hours[parent], items[parent], versions[parent] = hours[child], items[child], versions[child]
        parent = child
    hours[parent], items[parent], versions[parent] = hour, item, version
    return size
