"""Compiled simulation of missions under policies other than networks."""

from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.play import Buffers, is_busy, new_buffers
from alloc.allocators.learned.missions.situation import fill_own, fill_tasks
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.chance import first_key, keyed
from alloc.allocators.missions.layout import MESSAGES, NOBODY, OVER, TO_TASK, MissionArrays
from alloc.allocators.missions.orders import order
from alloc.allocators.missions.pack import begun
from alloc.allocators.online.compiled.auction import bid
from alloc.allocators.online.compiled.exploring import explore
from alloc.allocators.online.compiled.hedonic import join
from alloc.allocators.online.compiled.notes import BIDS, PARTITION, Notes, hear, notes_for, send
from alloc.allocators.online.compiled.utility import best_task, fill_with
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray, IntArray
from alloc.problems.missions.chance import EXPLORING

NEAREST, GREEDY, HEDONIC, AUCTION = range(4)
"""Codes of the policies."""

NAMES = ("nearest", "greedy", "hedonic", "auction")
NOTES = (0, 0, PARTITION, BIDS)


class Memory(NamedTuple):
    """Memory of all agents: notes, counts of random draws and of moves, ranks of ids, and an empty array."""

    notes: Notes
    drawn: IntArray
    moves: IntArray
    rank: IntArray
    none: FloatArray


@compiled_in_place
def nearest(state: MissionArrays, number: int, buffers: Buffers) -> int:
    """Return the nearest task, -1 for none."""
    fill_own(state, number, buffers.situation.own)
    fill_tasks(state, number, buffers.situation.task, buffers.situation.can)
    best, least = NOBODY, np.inf
    for j in range(len(buffers.situation.can)):
        if buffers.situation.can[j] and buffers.situation.task[known.DISTANCE, j] < least:
            best, least = j, buffers.situation.task[known.DISTANCE, j]
    return best


@compiled_in_place
def choose(
    state: MissionArrays,
    number: int,
    buffers: Buffers,
    policy_code: int,
    parameters: FloatArray,
    memory: Memory,
    seed: int,
) -> int:
    """Return the task that an agent is to go to, -1 for none."""
    if policy_code == GREEDY:
        fill_with(state, number, buffers.situation, parameters[1], memory.none)
        return best_task(buffers, int(buffers.situation.own[known.TARGET]), parameters)
    if policy_code == HEDONIC:
        return join(state, number, buffers, parameters, memory.notes, seed, memory.moves)
    if policy_code == AUCTION:
        return bid(state, number, buffers, parameters, memory.notes, memory.rank)
    return nearest(state, number, buffers)


@compiled_in_place
def run_to_end(
    state: MissionArrays,
    buffers: Buffers,
    policy_code: int,
    kind: int,
    parameters: FloatArray,
    memory: Memory,
    seed: int,
) -> None:
    """Run a mission to its end under a policy; `kind` is that of its notes, 0 for none."""
    head, key = state.head[0], keyed(first_key(EXPLORING), seed)
    while True:
        wanted = advance(state)
        if wanted == OVER:
            return
        if kind:
            hear(state, memory.notes, kind)
        if wanted == MESSAGES:
            if kind:
                send(state, memory.notes, kind)
            continue
        for place in range(head.deciding):
            number = state.deciding[place]
            if policy_code == NEAREST and state.agents[number].order == TO_TASK and is_busy(state, number):
                continue
            task = choose(state, number, buffers, policy_code, parameters, memory, seed)
            if task >= 0:
                order(state, number, TO_TASK, task, (0.0, 0.0, 0.0))
            else:
                explore(state, number, key, memory.drawn)


def final_state(arrays: MissionArrays, policy: str, parameters: FloatArray, seed: int, rank: IntArray) -> MissionArrays:
    """Run a mission to its end under a policy, and return its final state.

    Parameters
    ----------
    arrays : MissionArrays
        As returned by `pack`.
    policy : str
        One of `NAMES`.
    parameters : ndarray
        Parameters of the policy in the order of their fields.
    seed : int
        Seed of the run.
    rank : ndarray of int, shape (n,)
        Rank of each agent's id in alphabetical order.
    """
    state, policy_code = begun(arrays, seed), NAMES.index(policy)
    n, m, slots = len(state.agents), len(state.tasks), len(state.sent)
    none = np.zeros(n, np.intp)
    memory = Memory(notes_for(NOTES[policy_code], n, slots), none, none.copy(), rank, np.zeros(0))
    run_to_end(state, new_buffers(n, m), policy_code, NOTES[policy_code], parameters, memory, seed)
    return state
