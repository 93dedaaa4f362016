"""What is to come in a compiled mission: a heap in the order of hours, turns, and as it was put there."""

import numpy as np

from alloc.allocators.missions.layout import OPEN, Entry, MissionArrays
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.missions.simulation.agenda import Turn

ARRIVAL, COMPLETION, DEADLINE = int(Turn.ARRIVAL), int(Turn.COMPLETION), int(Turn.DEADLINE)


@compiled
def first_hour(state: MissionArrays) -> float:
    """Return the hour of the first entry, ``inf`` where there is none."""
    return state.agenda[0].hour if state.head[0].entries > 0 else np.inf


@compiled
def push(state: MissionArrays, hour: float, turn: int, item: int, version: int) -> None:
    """Put an entry on the agenda."""
    head = state.head[0]
    if head.entries == len(state.agenda):
        drop_void(state)
    head.count += 1
    entry = state.agenda[head.entries]
    entry.hour, entry.turn, entry.count, entry.item, entry.version = hour, turn, head.count, item, version
    head.entries += 1
    rise(state, head.entries - 1)


@compiled
def pop(state: MissionArrays) -> None:
    """Take the first entry off the agenda; it then stands behind the last one."""
    head = state.head[0]
    head.entries -= 1
    last = head.entries
    exchange(state.agenda[0], state.agenda[last])
    place = 0
    while True:
        least = place
        for child in (2 * place + 1, 2 * place + 2):
            if child < last and comes_before(state.agenda[child], state.agenda[least]):
                least = child
        if least == place:
            return
        exchange(state.agenda[place], state.agenda[least])
        place = least


@compiled
def rise(state: MissionArrays, place: int) -> None:
    """Let an entry rise to where it belongs."""
    while place > 0:
        parent = (place - 1) // 2
        if not comes_before(state.agenda[place], state.agenda[parent]):
            return
        exchange(state.agenda[place], state.agenda[parent])
        place = parent


@compiled
def comes_before(one: Entry, other: Entry) -> bool:
    """Whether one entry comes before another."""
    if one.hour != other.hour:
        return one.hour < other.hour
    if one.turn != other.turn:
        return one.turn < other.turn
    return one.count < other.count


@compiled
def exchange(one: Entry, other: Entry) -> None:
    """Exchange two entries."""
    one.hour, other.hour = other.hour, one.hour
    one.turn, other.turn = other.turn, one.turn
    one.count, other.count = other.count, one.count
    one.item, other.item = other.item, one.item
    one.version, other.version = other.version, one.version


@compiled
def is_void(state: MissionArrays, entry: Entry) -> bool:
    """Whether an entry will change nothing any more."""
    if entry.turn == ARRIVAL:
        return state.agents[entry.item].flight != entry.version
    if entry.turn == COMPLETION:
        task = state.tasks[entry.item]
        return task.status != OPEN or task.version != entry.version
    return False


@compiled
def drop_void(state: MissionArrays) -> None:
    """Take all void entries off a full agenda."""
    head = state.head[0]
    kept = 0
    for place in range(head.entries):
        if not is_void(state, state.agenda[place]):
            if kept != place:
                exchange(state.agenda[kept], state.agenda[place])
            kept += 1
    if kept == head.entries:
        raise OverflowError("the agenda of a compiled mission is full")
    head.entries = kept
    for place in range(kept):
        rise(state, place)
