"""Notes that policies add to messages, compiled: they are sent and received with the messages of a slot.

The notes of an agent are a row of numbers: a partition (the task of each agent, the number of changes and a stamp), or
the bids of all agents (a task, an amount and an hour for each).
"""

from typing import NamedTuple

import numpy as np

from alloc.allocators.missions.channel import is_silent
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, MissionArrays
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.errors import RefusedError
from alloc.problems.fields import FloatArray
from alloc.problems.missions.simulation.reports import BYTES_OF_VALUE

PARTITION, BIDS = 1, 3
"""Kinds of notes; the value is how many numbers there are for each agent."""

MAX_NOTES = 250_000_000
"""Largest total size of the notes of all agents; larger missions are refused."""

TASK, AMOUNT, HOUR = range(3)
"""Fields of a bid; a row has one field of all agents after another, in this order."""


class Notes(NamedTuple):
    """Notes of all agents.

    Attributes
    ----------
    own, heard : ndarray, shape (n, length)
        Notes of each agent, and those that it has received since its last decision.
    sent : ndarray, shape (k, n, length)
        Notes in transit, by slot.
    hour : ndarray, shape (k,)
        Hour at which they were sent, ``inf`` for unused slots.
    """

    own: FloatArray
    heard: FloatArray
    sent: FloatArray
    hour: FloatArray


def notes_for(kind: int, n: int, slots: int) -> Notes:
    """Return the notes at hour 0; rows are empty for kind 0.

    Raises
    ------
    RefusedError
        If there are too many agents for notes on all others.
    """
    if kind * n * n * (2 + slots) > MAX_NOTES:
        raise RefusedError(f"{n} agents are too many for a policy in which each agent keeps notes on all others")
    row = np.zeros(kind * n + 2 * (kind == PARTITION))
    row[: n * (kind > 0)] = NOBODY
    heard = row.copy()
    heard[n:] = -np.inf
    return Notes(np.tile(row, (n, 1)), np.tile(heard, (n, 1)), np.zeros((slots, n, len(row))), np.full(slots, np.inf))


@compiled_in_place
def copy(source: FloatArray, target: FloatArray) -> None:
    """Copy a row of notes."""
    for place in range(len(source)):
        target[place] = source[place]


@compiled_in_place
def precedes(one: FloatArray, other: FloatArray) -> bool:
    """Whether a partition takes precedence over another: more changes, then a higher stamp."""
    return bool(one[-2] > other[-2] or (one[-2] == other[-2] and one[-1] > other[-1]))


@compiled_in_place
def take_newer(bids: FloatArray, told: FloatArray) -> None:
    """Replace bids by newer ones."""
    n = len(bids) // BIDS
    for i in range(n):
        is_known = bids[i] != NOBODY
        if told[i] != NOBODY and (not is_known or bids[HOUR * n + i] < told[HOUR * n + i]):
            for part in range(BIDS):
                bids[part * n + i] = told[part * n + i]


@compiled_in_place
def hear(state: MissionArrays, notes: Notes, kind: int) -> None:
    """Deliver the notes that have arrived by now."""
    head = state.head[0]
    for slot in range(len(notes.hour)):
        if not notes.hour[slot] + head.delay <= head.hour:
            continue
        notes.hour[slot] = np.inf
        for number in range(len(notes.own)):
            first = state.first_sender[slot, number]
            for place in range(first, first + state.senders[slot, number]):
                told = notes.sent[slot, state.sender[slot, place]]
                if kind == BIDS:
                    take_newer(notes.heard[number], told)
                elif precedes(told, notes.heard[number]):
                    copy(told, notes.heard[number])


@compiled_in_place
def send(state: MissionArrays, notes: Notes, kind: int) -> None:
    """Send the notes of all agents with their present messages."""
    head, n = state.head[0], len(notes.own)
    slot = head.tick % len(notes.hour)
    notes.hour[slot] = head.hour
    for number in range(n):
        copy(notes.own[number], notes.sent[slot, number])
        agent = state.agents[number]
        if IDLE <= agent.status <= WORKING and not (head.silences and is_silent(state, number)):
            some = 0
            for i in range(n):
                some += notes.own[number, i] != NOBODY
            agent.bytes += BYTES_OF_VALUE * (4 * some if kind == BIDS else 2 + 2 * some)
