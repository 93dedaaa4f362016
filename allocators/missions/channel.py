"""The radio, compiled: see `alloc.problems.missions.simulation.channel`."""

import math

import numpy as np
from numpy.typing import NDArray

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.knowledge import fill_distances
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, Head, MissionArrays
from alloc.allocators.missions.motion import distance_between, place_of
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.fields import BoolArray, FloatArray, IntArray
from alloc.problems.missions.simulation.reports import BYTES_OF_AGENT, BYTES_OF_MESSAGE, BYTES_OF_TASK

Numbers = NDArray[np.int32]


@compiled
def is_silent(state: MissionArrays, number: int) -> bool:
    """Whether an agent can neither send nor hear now."""
    head = state.head[0]
    for place in range(head.silences):
        event = state.events[state.silences[place]]
        if head.hour >= event.until:
            continue
        if event.agent != NOBODY:
            if event.agent == number:
                return True
            continue
        here = place_of(state.agents[number], head.hour)
        if distance_between(head.is_manhattan, here, (event.x, event.y, event.z)) <= event.radius:
            return True
    return False


@compiled
def send_all(state: MissionArrays, slot: int) -> bool:
    """Send a message of each agent that can and will, all that it knows; return whether any is heard."""
    head = state.head[0]
    found = False
    state.heard[slot] = False
    for number in range(len(state.agents)):
        agent = state.agents[number]
        if not (state.visible[number] and agent.speaks) or (head.silences and is_silent(state, number)):
            continue
        agent.messages += 1
        agent.bytes += BYTES_OF_MESSAGE + BYTES_OF_AGENT * count_known(state.agent_hour, number)
        agent.bytes += BYTES_OF_TASK * count_known(state.task_hour, number)
        fill_distances(head, state.places, number, state.places, state.distance)
        if find_hearers(head, number, state.visible, state.distance, state.heard[slot, number]):
            found = True
            state.sent_task_hour[slot, number] = state.task_hour[number]
            state.sent_task_left[slot, number] = state.task_left[number]
            state.sent_agent_hour[slot, number] = state.agent_hour[number]
            state.sent_agent_report[slot, number] = state.agent_report[number]
    if head.has_burst and found:
        lose_in_bursts(head, state.heard[slot], state.link_number, state.link_bad)
    head.tick += 1
    return found


@compiled
def count_known(hours: FloatArray, row: int) -> int:
    """Return of how many agents or tasks something is known."""
    known = 0
    for place in range(hours.shape[1]):
        known += hours[row, place] >= 0
    return known


@compiled
def find_hearers(head: Head, sender: int, visible: BoolArray, distance: FloatArray, heard: BoolArray) -> bool:
    """Fill in who will hear the message that an agent sends now; return whether there is anybody."""
    found = False
    key = keyed(head.loss_key, sender)
    for number in range(len(visible)):
        if not visible[number] or number == sender or distance[number] > head.radius:
            continue
        if head.loss > 0 and fraction(keyed(keyed(key, number), head.tick)) < head.loss:
            continue
        heard[number] = found = True
    return found


@compiled
def lose_in_bursts(head: Head, heard: BoolArray, number: IntArray, bad: IntArray) -> None:
    """Lose messages of this tick by the state of each link."""
    for sender in range(len(heard)):
        for hearer in range(len(heard)):
            if heard[sender, hearer]:
                is_bad = is_link_bad(head, sender, hearer, number, bad)
                key = keyed(keyed(keyed(keyed(head.loss_key, sender), hearer), head.tick), 1)
                loss = head.burst_loss_bad if is_bad else head.burst_loss_good
                heard[sender, hearer] = fraction(key) >= loss


@compiled
def is_link_bad(head: Head, sender: int, hearer: int, number: IntArray, bad: IntArray) -> bool:
    """Whether a link is bad now; a Markov chain over all messages up to this one, whether sent or not."""
    key = keyed(keyed(head.burst_key, sender), hearer)
    share = head.burst_bad / (head.burst_good + head.burst_bad)
    is_bad = bad[sender, hearer]
    for step in range(number[sender, hearer] + 1, head.tick + 1):
        hours = head.period if step else np.inf
        forgotten = -math.expm1(-hours * (1 / head.burst_good + 1 / head.burst_bad))
        is_bad = int(fraction(keyed(key, step)) < share + (is_bad - share) * (1 - forgotten))
    number[sender, hearer], bad[sender, hearer] = head.tick, is_bad
    return is_bad != 0


@compiled
def deliver(state: MissionArrays, slot: int) -> None:
    """Let all hear what was sent to them."""
    head, heard = state.head[0], state.heard[slot]
    for number in range(len(state.agents)):
        is_there = IDLE <= state.agents[number].status <= WORKING
        if not is_there or (head.silences and is_silent(state, number)):
            heard[:, number] = False
    hear_of_tasks(heard, state.sent_task_hour[slot], state.sent_task_left[slot], state.task_hour, state.task_left)
    told = state.sent_agent_hour[slot], state.sent_agent_report[slot]
    hear_of_agents(heard, told[0], told[1], state.agent_hour, state.agent_report)


@compiled
def hear_of_tasks(
    heard: BoolArray, told_hour: FloatArray, told_left: FloatArray, hour: FloatArray, left: FloatArray
) -> None:
    """Take over what is newer in messages than what is known of tasks."""
    for sender in range(len(heard)):
        for number in range(len(heard)):
            if heard[sender, number]:
                for task in range(hour.shape[1]):
                    newer = told_hour[sender, task] > hour[number, task]
                    left[number, task] = told_left[sender, task] if newer else left[number, task]
                    hour[number, task] = told_hour[sender, task] if newer else hour[number, task]


@compiled
def hear_of_agents(heard: BoolArray, told_hour: FloatArray, told: Numbers, hour: FloatArray, report: Numbers) -> None:
    """Take over what is newer in messages than what is known of agents."""
    for sender in range(len(heard)):
        for number in range(len(heard)):
            if heard[sender, number]:
                for agent in range(hour.shape[1]):
                    newer = told_hour[sender, agent] > hour[number, agent]
                    report[number, agent] = told[sender, agent] if newer else report[number, agent]
                    hour[number, agent] = told_hour[sender, agent] if newer else hour[number, agent]
