"""The radio, compiled: see `alloc.problems.missions.simulation.channel`."""

import math

import numpy as np

from alloc.allocators.missions.chance import fraction, keyed
from alloc.allocators.missions.knowledge import hear, is_within
from alloc.allocators.missions.layout import IDLE, NOBODY, WORKING, MissionArrays
from alloc.allocators.missions.motion import distance_between, place_of
from alloc.allocators.runtime.compiled import compiled
from alloc.problems.missions.simulation.reports import BYTES_OF_AGENT, BYTES_OF_MESSAGE, BYTES_OF_TASK


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
        if not (IDLE <= agent.status <= WORKING and agent.speaks) or is_silent(state, number):
            continue
        agent.messages += 1
        agent.bytes += BYTES_OF_MESSAGE
        agent.bytes += BYTES_OF_AGENT * count_known(state.agent_hour[number])
        agent.bytes += BYTES_OF_TASK * count_known(state.task_hour[number])
        if find_hearers(state, number, state.heard[slot, number]):
            found = True
            state.sent_task_hour[slot, number] = state.task_hour[number]
            state.sent_task_left[slot, number] = state.task_left[number]
            state.sent_agent_hour[slot, number] = state.agent_hour[number]
            state.sent_agent_report[slot, number] = state.agent_report[number]
    head.tick += 1
    return found


@compiled
def count_known(hours: np.ndarray) -> int:
    """Return of how many agents or tasks something is known."""
    known = 0
    for place in range(len(hours)):
        known += hours[place] >= 0
    return known


@compiled
def find_hearers(state: MissionArrays, sender: int, heard: np.ndarray) -> bool:
    """Fill in who will hear the message that an agent sends now; return whether there is anybody."""
    head = state.head[0]
    x, y, z = state.places[0, sender], state.places[1, sender], state.places[2, sender]
    found = False
    for number in range(len(state.agents)):
        if number == sender or not IDLE <= state.agents[number].status <= WORKING:
            continue
        if not is_within(head.radius, head.is_manhattan, x, y, z, state.places, number):
            continue
        if not is_lost(state, sender, number, head.tick):
            heard[number] = found = True
    return found


@compiled
def is_lost(state: MissionArrays, sender: int, hearer: int, number: int) -> bool:
    """Whether a message is lost on the way."""
    head = state.head[0]
    key = keyed(keyed(keyed(head.loss_key, sender), hearer), number)
    if head.loss > 0 and fraction(key) < head.loss:
        return True
    if not head.has_burst:
        return False
    loss = head.burst_loss_bad if is_bad(state, sender, hearer, number) else head.burst_loss_good
    return fraction(keyed(key, 1)) < loss


@compiled
def is_bad(state: MissionArrays, sender: int, hearer: int, number: int) -> bool:
    """Whether a link is bad at a message; a Markov chain over all messages up to it, whether sent or not."""
    head = state.head[0]
    key = keyed(keyed(head.burst_key, sender), hearer)
    share = head.burst_bad / (head.burst_good + head.burst_bad)
    bad = state.link_bad[sender, hearer]
    for step in range(state.link_number[sender, hearer] + 1, number + 1):
        hours = head.period if step else np.inf
        forgotten = -math.expm1(-hours * (1 / head.burst_good + 1 / head.burst_bad))
        bad = int(fraction(keyed(key, step)) < share + (bad - share) * (1 - forgotten))
    state.link_number[sender, hearer], state.link_bad[sender, hearer] = number, bad
    return bad != 0


@compiled
def deliver(state: MissionArrays, slot: int) -> None:
    """Let all hear what was sent to them."""
    for sender in range(len(state.agents)):
        for number in range(len(state.agents)):
            if not state.heard[slot, sender, number] or not IDLE <= state.agents[number].status <= WORKING:
                continue
            if is_silent(state, number):
                continue
            told = state.sent_task_hour[slot, sender], state.sent_task_left[slot, sender]
            hear(state.task_hour[number], state.task_left[number], told[0], told[1])
            of_agents = state.sent_agent_hour[slot, sender], state.sent_agent_report[slot, sender]
            hear(state.agent_hour[number], state.agent_report[number], of_agents[0], of_agents[1])
