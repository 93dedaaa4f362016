"""Missions with decisions sampled from the network and recorded, in compiled loops."""

import math
from typing import NamedTuple

import numpy as np

from alloc.allocators.learned.missions.feature_names import FEATURES
from alloc.allocators.learned.missions.network_arrays import MissionWeights, Singles
from alloc.allocators.learned.missions.play import Buffers, choose_senders, give_order, score_options, should_decide
from alloc.allocators.missions.advance import advance
from alloc.allocators.missions.chance import first_key, fraction, keyed
from alloc.allocators.missions.layout import IDLE, MESSAGES, MISSED, OVER, WORKING, MissionArrays
from alloc.allocators.runtime.compiled import compiled_in_place
from alloc.problems.fields import FloatArray, IntArray

SAMPLING = 12
"""Purpose of the random numbers, see `alloc.problems.missions.chance`."""

MISSED_COST = 3.0
"""Cost of missing all priority, in ideal mission times."""


class Record(NamedTuple):
    """Decisions of a mission in chronological order.

    Attributes
    ----------
    options : ndarray, shape (most, options, FEATURES)
    choices, action, agent : ndarray of int, shape (most,)
        Number of options of each decision, the option chosen, and the agent.
    log_probability, hour : ndarray, shape (most,)
    cost : ndarray, shape (most,)
        Cost until then: hours in which agents did not work, as a mean weighted by ability, plus the cost of missed
        tasks.
    length : ndarray of int, shape (1,)
        Number of decisions.
    asked : ndarray, shape (n,)
        Hour of each agent's last decision.
    is_working : ndarray of bool, shape (n,)
        Whether it has worked since.
    total : ndarray, shape (2,)
        Cost of the mission so far, and its ideal time.
    """

    options: Singles
    choices: IntArray
    action: IntArray
    agent: IntArray
    log_probability: FloatArray
    hour: FloatArray
    cost: FloatArray
    length: IntArray
    asked: FloatArray
    is_working: FloatArray
    total: FloatArray


def record_for(n: int, m: int, most: int, ideal: float) -> Record:
    """Return storage for up to `most` decisions of n agents on m tasks in a mission with this ideal time."""
    return Record(
        options=np.zeros((most, m + 2, FEATURES), np.float32),
        choices=np.zeros(most, np.intp),
        action=np.zeros(most, np.intp),
        agent=np.zeros(most, np.intp),
        log_probability=np.zeros(most),
        hour=np.zeros(most),
        cost=np.zeros(most),
        length=np.zeros(1, np.intp),
        asked=np.full(n, -1.0),
        is_working=np.zeros(n),
        total=np.array([0.0, ideal]),
    )


@compiled_in_place
def account(state: MissionArrays, record: Record, number: int) -> None:
    """Add the hours since an agent's last decision to the cost if it did not work."""
    head, agent = state.head[0], state.agents[number]
    if record.asked[number] >= 0 and record.is_working[number] == 0:
        hours = head.hour - record.asked[number]
        ability = 0.0
        for other in range(len(state.agents)):
            ability += state.agents[other].ability
        record.total[0] += hours * agent.ability / ability
    record.asked[number] = head.hour


@compiled_in_place
def missed_cost(state: MissionArrays, ideal: float) -> float:
    """Return the cost of the tasks missed so far."""
    missed = total = 0.0
    for number in range(len(state.tasks)):
        task = state.tasks[number]
        total += task.priority
        missed += task.priority * (task.status == MISSED)
    return MISSED_COST * ideal * missed / total if total > 0 else 0.0


@compiled_in_place
def sample(buffers: Buffers, count: int, key: int) -> tuple[int, float]:
    """Draw an option from the softmax of the scores; return it and its log-probability."""
    highest, chosen = -np.inf, 0
    largest = buffers.scores[np.argmax(buffers.scores[:count])]
    total = 0.0
    for row in range(count):
        total += math.exp(buffers.scores[row] - largest)
        noisy = buffers.scores[row] - math.log(-math.log(fraction(keyed(key, row)) + 1e-300) + 1e-300)
        if noisy > highest:
            highest, chosen = noisy, row
    return chosen, buffers.scores[chosen] - largest - math.log(total)


@compiled_in_place
def rollout(state: MissionArrays, buffers: Buffers, weights: MissionWeights, seed: int, record: Record) -> None:
    """Sample the decisions of all agents from the network until the end of a mission, and record them.

    Parameters
    ----------
    state : MissionArrays
    buffers : Buffers
    weights : MissionWeights
    seed : int
        Seed of the run and of the samples.
    record : Record
        Record from `record_for`; when it is full, decisions are no longer recorded.
    """
    head = state.head[0]
    sensing = head.sensing if head.is_local else np.inf
    key, drawn = keyed(first_key(SAMPLING), seed), 0
    while True:
        wanted = advance(state)
        if wanted == OVER:
            for number in range(len(state.agents)):
                if IDLE <= state.agents[number].status <= WORKING:
                    account(state, record, number)
            record.total[0] += missed_cost(state, record.total[1])
            return
        if wanted == MESSAGES:
            choose_senders(state, buffers)
            continue
        missed = missed_cost(state, record.total[1])
        for place in range(head.deciding):
            number = state.deciding[place]
            account(state, record, number)
            if should_decide(state, buffers, number):
                count = score_options(buffers, state.area, sensing, seed, number, number, weights)
                option, log_probability = sample(buffers, count, keyed(key, drawn))
                drawn += 1
                k = record.length[0]
                if k < len(record.choices):
                    for row in range(count):
                        for feature in range(FEATURES):
                            record.options[k, row, feature] = buffers.options[row, feature]
                    record.choices[k], record.action[k], record.agent[k] = count, option, number
                    record.log_probability[k], record.hour[k] = log_probability, head.hour
                    record.cost[k] = record.total[0] + missed
                    record.length[0] += 1
                give_order(state, buffers, number, buffers.choice[option])
            record.is_working[number] = state.agents[number].status == WORKING
