"""Event queue of a compiled mission, called the agenda: a heap ordered by hour, turn and insertion."""

from collections.abc import Sequence

import numpy as np

from alloc.allocators.missions.layout import OPEN, MissionArrays
from alloc.allocators.missions.records import Agent, Entry, Head, Task
from alloc.allocators.runtime.compiled import compiled_in_place, inlined
from alloc.problems.missions.simulation.agenda import Turn

ARRIVAL, COMPLETION, DEADLINE = int(Turn.ARRIVAL), int(Turn.COMPLETION), int(Turn.DEADLINE)


@inlined
def first_hour(head: Head, agenda: Sequence[Entry]) -> float:
    """Return the hour of the first entry, ``inf`` if there is none."""
    return agenda[0].hour if head.entries > 0 else np.inf


@inlined
def push(state: MissionArrays, hour: float, turn: int, subject: int, version: int) -> None:
    """Add an entry; if the agenda is full, drop void ones first."""
    head, agenda = state.head[0], state.agenda
    if head.entries == len(agenda):
        drop_void(head, agenda, state.agents, state.tasks)
    insert(head, agenda, hour, turn, subject, version)


@compiled_in_place
def insert(head: Head, agenda: Sequence[Entry], hour: float, turn: int, subject: int, version: int) -> None:
    """Add an entry to an agenda with room for it."""
    head.count += 1
    entry = agenda[head.entries]
    entry.hour, entry.turn, entry.count, entry.subject, entry.version = hour, turn, head.count, subject, version
    head.entries += 1
    rise(agenda, head.entries - 1)


@compiled_in_place
def pop(head: Head, agenda: Sequence[Entry]) -> None:
    """Remove the first entry; it is then stored behind the last one."""
    head.entries -= 1
    last = head.entries
    exchange(agenda[0], agenda[last])
    place = 0
    while True:
        least = place
        for child in (2 * place + 1, 2 * place + 2):
            if child < last and comes_before(agenda[child], agenda[least]):
                least = child
        if least == place:
            return
        exchange(agenda[place], agenda[least])
        place = least


@compiled_in_place
def rise(agenda: Sequence[Entry], place: int) -> None:
    """Sift an entry up to its place."""
    while place > 0:
        parent = (place - 1) // 2
        if not comes_before(agenda[place], agenda[parent]):
            return
        exchange(agenda[place], agenda[parent])
        place = parent


@compiled_in_place
def comes_before(one: Entry, other: Entry) -> bool:
    """Whether one entry comes before another."""
    if one.hour != other.hour:
        return one.hour < other.hour
    if one.turn != other.turn:
        return one.turn < other.turn
    return one.count < other.count


@compiled_in_place
def exchange(one: Entry, other: Entry) -> None:
    """Exchange two entries."""
    one.hour, other.hour = other.hour, one.hour
    one.turn, other.turn = other.turn, one.turn
    one.count, other.count = other.count, one.count
    one.subject, other.subject = other.subject, one.subject
    one.version, other.version = other.version, one.version


@compiled_in_place
def is_void(agents: Sequence[Agent], tasks: Sequence[Task], entry: Entry) -> bool:
    """Whether an entry no longer has an effect."""
    if entry.turn == ARRIVAL:
        return agents[entry.subject].flight != entry.version
    if entry.turn == COMPLETION:
        task = tasks[entry.subject]
        return task.status != OPEN or task.version != entry.version
    return False


@compiled_in_place
def drop_void(head: Head, agenda: Sequence[Entry], agents: Sequence[Agent], tasks: Sequence[Task]) -> None:
    """Remove all void entries from a full agenda."""
    kept = 0
    for place in range(head.entries):
        if not is_void(agents, tasks, agenda[place]):
            if kept != place:
                exchange(agenda[kept], agenda[place])
            kept += 1
    if kept == head.entries:
        raise OverflowError("the agenda of a compiled mission is full")
    head.entries = kept
    for place in range(kept):
        rise(agenda, place)
