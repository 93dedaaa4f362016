"""Decisions of `hedonic`, compiled: see `alloc.allocators.online.policies.hedonic`."""

import numpy as np

from alloc.allocators.learned.missions.play import Buffers
from alloc.allocators.missions.chance import first_key, fraction, keyed
from alloc.allocators.missions.layout import NOBODY, MissionArrays
from alloc.allocators.online.compiled.notes import Notes, copy, precedes
from alloc.allocators.online.compiled.utility import best_task, fill_with
from alloc.allocators.online.policies.hedonic import STAMP
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray, IntArray


@compiled_in_place
def join(
    state: MissionArrays,
    number: int,
    buffers: Buffers,
    parameters: FloatArray,
    notes: Notes,
    seed: int,
    moves: IntArray,
) -> int:
    """Return the task of the coalition that an agent joins, -1 for none; `moves` counts its changes."""
    partition, heard, n = notes.own[number], notes.heard[number], len(notes.own)
    row = state.agents[number].known
    if precedes(heard, partition):
        copy(heard, partition)
    heard[n:] = -np.inf
    for i in range(n):
        task = int(partition[i])
        if task != NOBODY and state.task_hour[row, task] >= 0 and state.task_left[row, task] < 0:
            partition[i] = NOBODY
    fill_with(state, number, buffers.situation, parameters[1], partition[:n])
    home = int(partition[number])
    choice = best_task(buffers, home, parameters)
    if choice != home:
        partition[number] = choice
        partition[n] += 1
        moves[number] += 1
        key = keyed(keyed(keyed(first_key(STAMP), seed), number + 1), moves[number])
        partition[n + 1] = fraction(key)
    return choice
