"""Decisions of `auction`, compiled: see `alloc.allocators.online.policies.auction`."""

import math

import numpy as np

from alloc.allocators.learned.missions import situation as known
from alloc.allocators.learned.missions.play import Buffers
from alloc.allocators.learned.missions.situation import fill_own, fill_tasks
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, MissionArrays
from alloc.allocators.missions.reports import NOTHING
from alloc.allocators.online.compiled.notes import AMOUNT, HOUR, Notes, take_newer
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray, IntArray


@compiled_in_place
def bid(
    state: MissionArrays, number: int, buffers: Buffers, parameters: FloatArray, notes: Notes, rank: IntArray
) -> int:
    """Return the task for which an agent bids, -1 for none.

    Parameters
    ----------
    state : MissionArrays
    number : int
        Index of the agent.
    buffers : Buffers
    parameters : ndarray
        In the order of `AuctionPolicyParameters`.
    notes : Notes
    rank : ndarray of int, shape (n,)
        Rank of each agent's id in alphabetical order.
    """
    memory, stay, seats_factor, flight, age = parameters
    situation, bids, n = buffers.situation, notes.own[number], len(notes.own)
    fill_own(state, number, situation.own)
    fill_tasks(state, number, situation.task, situation.can)
    take_newer(bids, notes.heard[number])
    notes.heard[number, :n] = NOBODY
    seats = count_seats(state, number, bids, seats_factor)
    own, task, hour = situation.own, situation.task, situation.own[known.HOUR]
    best, highest, amount_of_best = NOBODY, 0.0, 0.0
    for j in range(len(situation.can)):
        if not situation.can[j]:
            continue
        is_own = own[known.TARGET] == j
        hours = 0.0 if is_own and own[known.IS_WORKING] > 0 else task[known.DISTANCE, j] / own[known.SPEED]
        if hour + hours >= task[known.DEADLINE, j]:
            continue
        work = (task[known.LEFT, j] + 1e-9) / (own[known.ABILITY] * seats)
        amount = (task[known.PRIORITY, j] + 1e-6) * (work / (work + flight * hours))
        amount *= math.exp(-age * (hour - task[known.KNOWN_AT, j]))
        value = amount * stay if is_own else amount
        if value > highest and not is_outbid(bids, number, j, amount, hour, memory, seats, rank):
            best, highest, amount_of_best = j, value, amount
    bids[number] = best
    bids[AMOUNT * n + number], bids[HOUR * n + number] = amount_of_best, hour
    return best


@compiled_in_place
def count_seats(state: MissionArrays, number: int, bids: FloatArray, factor: float) -> int:
    """Return the seats of a task; drop the bids of agents that have since been seen on their way to another task."""
    row, agents, tasks, n = state.agents[number].known, 0, 0, len(state.agents)
    for i in range(n):
        report = state.reports[state.known_report[row, i]]
        agents += IDLE <= report.status <= WORKING
        if state.known_report[row, i] != NOTHING and report.hour > bids[HOUR * n + i] and report.task != bids[i]:
            bids[i] = NOBODY
    for j in range(len(state.tasks)):
        tasks += state.task_hour[row, j] >= 0 and state.task_left[row, j] >= 0
    return max(1, int(np.ceil(factor * agents / max(1, tasks))))


@compiled_in_place
def is_outbid(
    bids: FloatArray, number: int, task: int, amount: float, hour: float, memory: float, seats: int, rank: IntArray
) -> bool:
    """Whether other agents hold all seats of a task with higher, unexpired bids; ids break ties."""
    higher, n = 0, len(rank)
    for i in range(n):
        if bids[i] == task and i != number and hour - bids[HOUR * n + i] <= memory:
            other = bids[AMOUNT * n + i]
            higher += other > amount or (other == amount and rank[i] > rank[number])
    return higher >= seats
